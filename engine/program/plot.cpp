// engine/program/plot.cpp
// In order: text, the lines, one panel, the picture, thinning.
#include "engine/program/plot.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "engine/files/output_file.hpp"
#include "engine/program/plot_scale.hpp"

namespace linden::plot {
namespace {

using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// lengths are in pixels of the SVG; a PNG has two dots to each
constexpr double margin = 18, plot_width = 640, text_size = 11.5, title_size = 15, line_height = 16;
constexpr double dots = 2;

struct Colour {
  double r, g, b;
};
constexpr Colour ink{0.13, 0.13, 0.13}, text_grey{0.36, 0.36, 0.36}, axis_grey{0.45, 0.45, 0.45},
    guide_grey{0.52, 0.52, 0.52}, grid_grey{0.89, 0.89, 0.89}, minor_grey{0.95, 0.95, 0.95}, white{1, 1, 1};

// lightness L* 21, 49, 62, 38, 58, 33: neighbours differ in print without colour and to colour-blind eyes
constexpr std::array<Colour, 6> palette{{{0.063, 0.192, 0.420},
                                         {0.800, 0.294, 0.086},
                                         {0.180, 0.620, 0.760},
                                         {0.500, 0.250, 0.560},
                                         {0.680, 0.520, 0.040},
                                         {0.300, 0.300, 0.300}}};

struct Dashes {
  std::array<double, 4> lengths;
  int count;
};
constexpr std::array<Dashes, 4> dashes{{{{}, 0}, {{7, 3}, 2}, {{2, 2.2}, 2}, {{8, 2.5, 2, 2.5}, 4}}};

bool drawable(Point p) { return std::isfinite(p.x) && std::isfinite(p.y); }

// text

void set_colour(cairo_t* c, Colour k) { cairo_set_source_rgb(c, k.r, k.g, k.b); }

void set_font(cairo_t* c, double size, bool bold = false) {
  cairo_select_font_face(c, "sans", CAIRO_FONT_SLANT_NORMAL, bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(c, size);
  // unhinted, so that SVG and PNG are laid out alike
  const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(
      cairo_font_options_create(), &cairo_font_options_destroy);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_set_font_options(c, options.get());
}

double text_width(cairo_t* c, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(c, text.c_str(), &extents);
  return extents.x_advance;
}

/// `align` 0: the text begins at x, 0.5: is centred there, 1: ends there. y is the base line.
void show(cairo_t* c, double x, double y, const std::string& text, double align = 0) {
  cairo_move_to(c, x - align * text_width(c, text), y);
  cairo_show_text(c, text.c_str());
}

std::vector<std::string> wrapped(cairo_t* c, const std::string& text, double width) {
  std::vector<std::string> lines;
  for (std::size_t at = 0, end; at < text.size(); at = end + 1) {
    end = std::min(text.find_first_of(" \n", at), text.size());
    const std::string word = text.substr(at, end - at);
    if (lines.empty() || text[at - 1] == '\n' || text_width(c, lines.back() + ' ' + word) > width) lines.push_back(word);
    else lines.back() += ' ' + word;
  }
  return lines;
}

/// Places as near as possible (least squares) to the wanted ones, at least `gap` apart, within lo … hi.
std::vector<double> spread(const std::vector<double>& wanted, double gap, double lo, double hi) {
  const std::size_t n = wanted.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return wanted[a] < wanted[b]; });
  // less the gaps the places need only ascend: isotonic regression by pooling neighbours
  struct Pool {
    double sum, count;
  };
  std::vector<Pool> pools;
  for (std::size_t k = 0; k < n; ++k) {
    Pool pool{wanted[order[k]] - gap * static_cast<double>(k), 1};
    for (; !pools.empty() && pools.back().sum * pool.count > pool.sum * pools.back().count; pools.pop_back())
      pool = {pool.sum + pools.back().sum, pool.count + pools.back().count};
    pools.push_back(pool);
  }
  std::vector<double> placed(n);
  const double top = std::max(lo, hi - gap * (static_cast<double>(n) - 1));
  double k = 0;
  for (const Pool& pool : pools)
    for (double i = 0; i < pool.count; ++i, ++k)
      placed[order[static_cast<std::size_t>(k)]] = std::clamp(pool.sum / pool.count, lo, top) + k * gap;
  return placed;
}

// lines

struct Style {
  Colour colour;
  Dashes dash;
  double width;
  std::size_t shape;
};

/// The style of each series; guides take none of the colours.
std::vector<Style> styles(const Chart& chart) {
  std::vector<Style> result;
  std::size_t k = 0;
  for (const Series& s : chart.series) {
    if (s.mark == Mark::guide) result.push_back({guide_grey, {{1.2, 2.4}, 2}, 1.1, 0});
    else result.push_back({palette[k % palette.size()], dashes[k % dashes.size()], 1.7, k % 4}), ++k;
  }
  return result;
}

// coordinates in eighths: finer than the eye, and short in an SVG
double eighth(double v) { return std::round(8 * v) / 8; }

void trace(cairo_t* c, const std::vector<Point>& points, const Style& style) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (const double d = std::hypot(points[i].x - points[i - 1].x, points[i].y - points[i - 1].y); d > 0) length += d;
  const bool dense = length > 8 * plot_width;  // dashes on a band of oscillation would read as noise
  set_colour(c, style.colour);
  cairo_set_line_width(c, dense ? 0.6 * style.width : style.width);
  cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(c, style.dash.count == 0 || dense ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
  cairo_set_dash(c, style.dash.lengths.data(), dense ? 0 : style.dash.count, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point p{eighth(points[i].x), eighth(points[i].y)};
    if (!drawable(p)) continue;
    const bool begins = i == 0 || !drawable(points[i - 1]);
    if (begins) cairo_move_to(c, p.x, p.y);
    // a point alone between two gaps becomes a dash of its own, since butt caps would hide it
    if (!begins) cairo_line_to(c, p.x, p.y);
    else if (i + 1 == points.size() || !drawable(points[i + 1])) cairo_rel_line_to(c, 1, 0);
  }
  cairo_stroke(c);
  cairo_set_dash(c, nullptr, 0, 0);
}

void trace_markers(cairo_t* c, const std::vector<Point>& points, const Style& style) {
  constexpr std::array<int, 4> corners{0, 4, 3, 4};
  constexpr std::array<double, 4> turn{0, 0.5, 0.75, 0}, radius{3.3, 4.1, 4.4, 4.3};
  for (const Point& p : points) {
    if (!drawable(p)) continue;
    const double x = eighth(p.x), y = eighth(p.y), r = radius[style.shape];
    cairo_new_sub_path(c);
    if (corners[style.shape] == 0) cairo_arc(c, x, y, r, 0, 2 * M_PI);
    for (int k = 0; k < corners[style.shape]; ++k) {
      const double angle = 2 * M_PI * (k + turn[style.shape]) / corners[style.shape];
      cairo_line_to(c, eighth(x + r * std::cos(angle)), eighth(y - r * std::sin(angle)));
    }
    cairo_close_path(c);
  }
  set_colour(c, white);  // a thin rim keeps neighbours apart
  cairo_set_line_width(c, 1.4);
  cairo_stroke_preserve(c);
  set_colour(c, style.colour);
  cairo_fill(c);
}

// a panel

struct Panel {
  const Chart& chart;
  Scale x, y;
  std::vector<std::string> title, subtitle;  // broken into lines
  double height;                             // of the area within the axes
};

/// Checks the chart and finds its scales; `name` begins the messages.
Panel make_panel(const Chart& chart, bool alone, const std::string& name) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const Scale any_x{chart.x.log, 0, 1, {}, {}}, any_y{chart.y.log, 0, 1, {}, {}};
  double x_lo = inf, x_hi = -inf, y_lo = inf, y_hi = -inf;
  bool markers = false;
  for (const Series& s : chart.series) {
    if (s.x.size() != s.y.size())
      throw std::runtime_error(fmt::format("{}: series '{}' has {} x and {} y; give it as many of both", name, s.label,
                                           s.x.size(), s.y.size()));
    markers = markers || s.mark == Mark::points || s.mark == Mark::both;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!drawable({any_x(s.x[i]), any_y(s.y[i])})) continue;
      x_lo = std::min(x_lo, s.x[i]), x_hi = std::max(x_hi, s.x[i]);
      y_lo = std::min(y_lo, s.y[i]), y_hi = std::max(y_hi, s.y[i]);
    }
  }
  if (x_lo > x_hi)
    throw std::runtime_error(fmt::format(
        "{}: no point to draw in {} series; expected one with finite x and y{}", name, chart.series.size(),
        chart.x.log || chart.y.log ? ", above zero on a log axis" : ""));
  // every label at the end of a line gets its own row
  const double rows = line_height * static_cast<double>(chart.series.size());
  const double height = std::max(alone ? 320.0 : 210.0, rows);
  return {chart, make_scale(chart.x, x_lo, x_hi, markers ? 0.03 : 0, 75 / plot_width),
          make_scale(chart.y, y_lo, y_hi, 0.06, 34 / height), {}, {}, height};
}

double height_of(const Panel& panel) {
  const auto rows = [](const std::vector<std::string>& lines) { return static_cast<double>(lines.size()); };
  return (title_size + 6) * rows(panel.title) + line_height * rows(panel.subtitle) + 28 + panel.height + 40;
}

void draw_axes(cairo_t* c, const Panel& panel, double left, double top) {
  const double right = left + plot_width, bottom = top + panel.height;
  const auto line = [&](double x0, double y0, double x1, double y1, Colour colour, double width) {
    set_colour(c, colour);
    cairo_set_line_width(c, width);
    cairo_move_to(c, x0, y0);
    cairo_line_to(c, x1, y1);
    cairo_stroke(c);
  };
  for (const bool labelled : {false, true}) {  // minor lines lie below
    for (const auto& [at, label] : panel.x.ticks)
      if (const double x = eighth(left + at * plot_width); label.empty() != labelled)
        line(x, top, x, bottom, labelled ? grid_grey : minor_grey, 0.8);
    for (const auto& [at, label] : panel.y.ticks)
      if (const double y = eighth(bottom - at * panel.height); label.empty() != labelled)
        line(left, y, right, y, label == "0" ? axis_grey : labelled ? grid_grey : minor_grey, 0.8);
  }
  line(left, bottom, right, bottom, axis_grey, 1);
  set_font(c, text_size);
  for (const auto& [at, label] : panel.x.ticks) {
    const double x = eighth(left + at * plot_width);
    line(x, bottom, x, bottom + (label.empty() ? 3 : 5), axis_grey, 1);
    set_colour(c, text_grey);
    show(c, x, bottom + 18, label, 0.5);
  }
  for (const auto& [at, label] : panel.y.ticks) show(c, left - 8, bottom - at * panel.height + 4, label, 1);
  set_colour(c, ink);
  show(c, left + plot_width / 2, bottom + 35, panel.x.label, 0.5);
  show(c, margin, top - 13, panel.y.label);
}

void draw_series(cairo_t* c, const Panel& panel, double left, double top) {
  const double right = left + plot_width, bottom = top + panel.height;
  const std::vector<Style> style = styles(panel.chart);
  std::vector<Point> ends;
  for (std::size_t k = 0; k < style.size(); ++k) {
    const Series& s = panel.chart.series[k];
    std::vector<Point> points(s.x.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = {plot_width * panel.x(s.x[i]), panel.height * (1 - panel.y(s.y[i]))};
    const bool markers = s.mark == Mark::points || s.mark == Mark::both;
    const std::vector<Point> path = thinned(points, 1), spots = thinned(points, markers ? 4 : plot_width);
    const auto paint = [&](cairo_t* to) {
      if (s.mark != Mark::points) trace(to, path, style[k]);
      if (markers) trace_markers(to, spots, style[k]);
    };
    cairo_save(c);
    cairo_translate(c, left, top);
    if (path.size() < 12000) {
      paint(c);
    } else {  // a curve that doubles back all the time is smaller as an image
      constexpr double rim = 6;
      const Surface image(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, static_cast<int>(dots * (plot_width + 2 * rim)),
                                                     static_cast<int>(dots * (panel.height + 2 * rim))),
                          &cairo_surface_destroy);
      const Context to(cairo_create(image.get()), &cairo_destroy);
      cairo_scale(to.get(), dots, dots);
      cairo_translate(to.get(), rim, rim);
      paint(to.get());
      cairo_translate(c, -rim, -rim);
      cairo_scale(c, 1 / dots, 1 / dots);
      cairo_set_source_surface(c, image.get(), 0, 0);
      cairo_paint(c);
    }
    cairo_restore(c);
    const auto last = std::find_if(points.rbegin(), points.rend(), drawable);
    ends.push_back(last == points.rend() ? Point{nan, panel.height} : *last);
  }

  std::vector<std::size_t> named;
  std::vector<double> wanted;
  for (std::size_t k = 0; k < style.size(); ++k)
    if (!panel.chart.series[k].label.empty()) named.push_back(k), wanted.push_back(top + ends[k].y);
  const std::vector<double> placed = spread(wanted, line_height - 1, top + 4, bottom - 4);
  set_font(c, text_size, true);
  for (std::size_t i = 0; i < named.size(); ++i) {
    const auto [r, g, b] = style[named[i]].colour;
    const Point end{left + ends[named[i]].x, top + ends[named[i]].y};
    if (drawable(end) && (std::abs(placed[i] - end.y) > 2 || right - end.x > 30)) {  // lead the eye to its label
      cairo_set_source_rgba(c, r, g, b, 0.6);
      cairo_set_line_width(c, 0.7);
      cairo_move_to(c, eighth(end.x + 3), eighth(end.y));
      cairo_line_to(c, right + 9, eighth(placed[i]));
      cairo_stroke(c);
    }
    cairo_set_source_rgb(c, 0.85 * r, 0.85 * g, 0.85 * b);
    show(c, right + 12, placed[i] + 4, panel.chart.series[named[i]].label + (drawable(end) ? "" : " (no points)"));
  }
}

// the picture

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int size) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), size);
  return CAIRO_STATUS_SUCCESS;
}

void require(cairo_status_t status, const std::string& file) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(fmt::format("{}: cannot draw: {}", file, cairo_status_to_string(status)));
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') result += "&amp;";
    else if (c == '<') result += "&lt;";
    else result += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return result;
}

/// The words of the picture as elements of SVG.
std::string description(const std::vector<Panel>& panels) {
  std::string words;
  for (const auto& [chart, x, y, title, subtitle, height] : panels) {
    words += fmt::format("{}. {}. {} over {}:", chart.title, chart.subtitle, y.label, x.label);
    for (const Series& s : chart.series) words += fmt::format(" {};", s.label);
    words += '\n';
  }
  return fmt::format("\n<title>{}</title>\n<desc>{}</desc>", escaped(panels[0].chart.title), escaped(words));
}

std::string picture(const std::string& file, bool svg, std::vector<Panel>& panels) {
  // measured first: the picture is as wide as its labels want
  const Surface scratch(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1), &cairo_surface_destroy);
  const Context measure(cairo_create(scratch.get()), &cairo_destroy);
  double left = 0, right = 0;
  for (const Panel& panel : panels) {
    set_font(measure.get(), text_size);
    for (const Tick& tick : panel.y.ticks) left = std::max(left, text_width(measure.get(), tick.label));
    set_font(measure.get(), text_size, true);
    for (const Series& s : panel.chart.series) right = std::max(right, text_width(measure.get(), s.label + "  "));
  }
  left = std::ceil(margin + left + 10);
  const double width = std::ceil(left + plot_width + std::max(right + 12, 12.0) + margin);
  double height = margin;
  for (Panel& panel : panels) {
    set_font(measure.get(), title_size, true);
    panel.title = wrapped(measure.get(), panel.chart.title, width - 2 * margin);
    set_font(measure.get(), text_size);
    panel.subtitle = wrapped(measure.get(), panel.chart.subtitle, width - 2 * margin);
    height += std::ceil(height_of(panel) + margin);
  }
  require(cairo_status(measure.get()), file);

  std::string bytes;
  Surface surface(svg ? cairo_svg_surface_create_for_stream(append, &bytes, width, height)
                      : cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(dots * width),
                                                   static_cast<int>(dots * height)),
                  &cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), file);
  if (svg) cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  const Context context(cairo_create(surface.get()), &cairo_destroy);
  cairo_t* c = context.get();
  if (!svg) cairo_scale(c, dots, dots);
  set_colour(c, white);
  cairo_paint(c);
  double y = margin;
  for (const Panel& panel : panels) {
    set_colour(c, ink);
    set_font(c, title_size, true);
    for (const std::string& line : panel.title) show(c, margin, y += title_size, line), y += 6;
    set_colour(c, text_grey);
    set_font(c, text_size);
    for (const std::string& line : panel.subtitle) show(c, margin, (y += line_height) - 4, line);
    y += 28;
    draw_axes(c, panel, left, y);
    draw_series(c, panel, left, y);
    y += panel.height + 40 + margin;
  }
  require(cairo_status(c), file);
  if (!svg) require(cairo_surface_write_to_png_stream(surface.get(), append, &bytes), file);
  cairo_surface_finish(surface.get());  // an SVG is written here
  require(cairo_surface_status(surface.get()), file);
  if (svg) bytes.insert(bytes.find('>', bytes.find("<svg")) + 1, description(panels));
  return bytes;
}

}  // namespace

std::vector<Point> thinned(std::span<const Point> points, double column) {
  std::vector<Point> kept;
  bool gap = false;
  for (std::size_t i = 0; i < points.size();) {
    if (!drawable(points[i])) {
      gap = true, ++i;
      continue;
    }
    if (gap && !kept.empty()) kept.push_back({nan, nan});
    gap = false;
    const std::size_t first = i;
    std::size_t low = i, high = i, last = i;
    for (; i < points.size(); ++i) {
      if (!drawable(points[i])) {
        gap = true;
        continue;
      }
      if (std::floor(points[i].x / column) != std::floor(points[first].x / column)) break;
      gap = false, last = i;
      if (points[i].y < points[low].y) low = i;
      if (points[i].y > points[high].y) high = i;
    }
    std::size_t before = points.size();
    for (const std::size_t k : {first, std::min(low, high), std::max(low, high), last})
      if (k != before) kept.push_back(points[before = k]);
  }
  return kept;
}

void draw(const std::string& file, std::span<const Chart> panels) {
  const std::filesystem::path target(file), folder = target.parent_path();
  std::string ending = target.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  if (ending != ".svg" && ending != ".png")
    throw std::runtime_error(fmt::format("{}: unknown ending '{}' of a picture; expected .svg or .png", file, ending));
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw std::runtime_error(fmt::format("{}: there is no folder '{}'; create it first", file, folder.string()));
  if (panels.empty()) throw std::runtime_error(fmt::format("{}: nothing to draw; expected at least one chart", file));
  std::vector<Panel> made;
  for (const Chart& chart : panels)
    made.push_back(make_panel(chart, panels.size() == 1, fmt::format("{}: chart '{}'", file, chart.title)));
  write_file(file, picture(file, ending == ".svg", made));
}

void draw(const std::string& file, const Chart& chart) { draw(file, std::span(&chart, 1)); }

}  // namespace linden::plot
