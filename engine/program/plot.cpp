// engine/program/plot.cpp
// In order: one panel, the picture, thinning.
#include "engine/program/plot.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <stdexcept>

#include "engine/files/output_file.hpp"
#include "engine/program/plot_pen.hpp"
#include "engine/program/plot_scale.hpp"

namespace linden::plot {
namespace {

using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// lengths are in pixels of the SVG; a PNG has two dots to each
constexpr double margin = 18, text_size = 11.5, note_size = 9, title_size = 15, line_height = 16;
constexpr double dots = 2;

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
    if (!s.notes.empty() && s.notes.size() != s.x.size())
      throw std::runtime_error(fmt::format("{}: series '{}' has {} points and {} notes; give it one for each point, or none", name,
                                           s.label, s.x.size(), s.notes.size()));
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
  // every label at the end of a line gets its own row, and every decade if that makes the panel no higher than one that is alone
  constexpr double most = 320, least = 210, label = 17;
  const double rows = line_height * static_cast<double>(chart.series.size());
  const double decades = chart.y.log ? 1.2 * std::log10(y_hi / y_lo) : 0;
  const double height = std::max({alone ? most : least, rows, std::min(label * decades, most)});
  // on a log axis labels are short, and a decade more that has one is worth more than air
  return {chart, make_scale(chart.x, x_lo, x_hi, markers ? 0.03 : 0, (chart.x.log ? 50 : 75) / plot_width),
          make_scale(chart.y, y_lo, y_hi, 0.06, (chart.y.log ? label : 2 * label) / height), {}, {}, height};
}

double height_of(const Panel& panel) {
  const auto rows = [](const std::vector<std::string>& lines) { return static_cast<double>(lines.size()); };
  return (title_size + 6) * rows(panel.title) + line_height * rows(panel.subtitle) + 28 + panel.height + 40;
}

void draw_axes(cairo_t* c, const Panel& panel, double left, double top) {
  const double right = left + plot_width, bottom = top + panel.height;
  const auto line = [&](double x0, double y0, double x1, double y1) {
    cairo_move_to(c, eighth(x0), eighth(y0));
    cairo_line_to(c, eighth(x1), eighth(y1));
  };
  const auto stroke = [&](Colour colour, double width) {
    set_colour(c, colour);
    cairo_set_line_width(c, width);
    cairo_stroke(c);
  };
  for (const bool labelled : {false, true}) {  // minor lines lie below
    for (const auto& [at, label] : panel.x.ticks)
      if (label.empty() != labelled) line(left + at * plot_width, top, left + at * plot_width, bottom);
    for (const auto& [at, label] : panel.y.ticks)
      if (label.empty() != labelled) line(left, bottom - at * panel.height, right, bottom - at * panel.height);
    stroke(labelled ? grid_grey : minor_grey, 0.8);
  }
  for (const auto& [at, label] : panel.y.ticks)
    if (label == "0") line(left, bottom - at * panel.height, right, bottom - at * panel.height);
  line(left, top, left, bottom);
  line(left, bottom, right, bottom);
  for (const auto& [at, label] : panel.x.ticks)
    line(left + at * plot_width, bottom, left + at * plot_width, bottom + (label.empty() ? 3 : 5));
  for (const auto& [at, label] : panel.y.ticks)
    line(left - (label.empty() ? 3 : 5), bottom - at * panel.height, left, bottom - at * panel.height);
  stroke(axis_grey, 1);
  set_font(c, text_size);
  set_colour(c, text_grey);
  for (const auto& [at, label] : panel.x.ticks) show(c, eighth(left + at * plot_width), bottom + 18, label, 0.5);
  for (const auto& [at, label] : panel.y.ticks) show(c, left - 8, bottom - at * panel.height + 4, label, 1);
  set_colour(c, ink);
  show(c, left + plot_width / 2, bottom + 35, panel.x.label, 0.5);
  show(c, margin, top - 13, panel.y.label);
}

/// The points of each series within the axes, from their upper left corner.
std::vector<std::vector<Point>> points_of(const Panel& panel) {
  std::vector<std::vector<Point>> all;
  for (const Series& s : panel.chart.series) {
    std::vector<Point>& points = all.emplace_back(s.x.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = {plot_width * panel.x(s.x[i]), panel.height * (1 - panel.y(s.y[i]))};
  }
  return all;
}

bool has_markers(const Series& series) { return series.mark == Mark::points || series.mark == Mark::both; }

void draw_curve(cairo_t* c, const Panel& panel, const Series& series, const std::vector<Point>& points, const Style& style) {
  const bool markers = has_markers(series);
  const std::vector<Point> path = thinned(points, 1), spots = thinned(points, markers ? 4 : plot_width);
  const auto paint = [&](cairo_t* to) {
    if (series.mark != Mark::points) trace(to, path, style);
    if (markers) trace_markers(to, spots, style);
  };
  if (path.size() < 12000) return paint(c);
  // a curve that doubles back all the time is smaller as an image
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

Colour darker(Colour k) { return {0.85 * k.r, 0.85 * k.g, 0.85 * k.b}; }

void draw_notes(cairo_t* c, const Panel& panel, const std::vector<std::vector<Point>>& points, const std::vector<Style>& style) {
  std::vector<Point> markers;
  std::vector<Note> notes;
  set_font(c, note_size);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Series& s = panel.chart.series[k];
    if (has_markers(s)) markers.insert(markers.end(), points[k].begin(), points[k].end());
    for (std::size_t i = 0; i < s.notes.size(); ++i) notes.push_back({points[k][i], text_width(c, s.notes[i]), 0.75 * note_size});
  }
  const std::vector<Point> places = note_places(notes, markers, {plot_width, panel.height});
  auto place = places.begin();
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (const std::string& note : panel.chart.series[k].notes) {
      const Point at = *place++;
      if (drawable(at)) show_over(c, at.x, at.y, note, darker(style[k].colour));
    }
  }
}

/// What a series is called at the right of the axes.
std::string name_of(const Panel& panel, const Series& series) {
  for (std::size_t i = 0; i < series.x.size(); ++i)
    if (drawable({panel.x(series.x[i]), panel.y(series.y[i])})) return series.label;
  return series.label.empty() ? "" : series.label + " (no points)";
}

/// These names, at the right of the axes, led to from where it ends.
void draw_names(cairo_t* c, const Panel& panel, const std::vector<std::vector<Point>>& points, const std::vector<Style>& style) {
  std::vector<std::size_t> named;
  std::vector<Point> ends;
  std::vector<double> wanted;
  for (std::size_t k = 0; k < style.size(); ++k) {
    if (panel.chart.series[k].label.empty()) continue;
    const auto last = std::find_if(points[k].rbegin(), points[k].rend(), drawable);
    named.push_back(k);
    ends.push_back(last == points[k].rend() ? Point{nan, panel.height} : *last);
    wanted.push_back(ends.back().y);
  }
  const std::vector<double> placed = spread(wanted, line_height - 1, 4, panel.height - 4);
  set_font(c, text_size, true);
  for (std::size_t i = 0; i < named.size(); ++i) {
    const Colour colour = style[named[i]].colour;
    const Point end = ends[i];
    if (drawable(end) && (std::abs(placed[i] - end.y) > 2 || plot_width - end.x > 30)) {  // lead the eye to its label
      cairo_set_source_rgba(c, colour.r, colour.g, colour.b, 0.6);
      cairo_set_line_width(c, 0.7);
      cairo_move_to(c, eighth(end.x + 3), eighth(end.y));
      cairo_line_to(c, plot_width + 9, eighth(placed[i]));
      cairo_stroke(c);
    }
    set_colour(c, darker(colour));
    show(c, plot_width + 12, placed[i] + 4, name_of(panel, panel.chart.series[named[i]]));
  }
}

void draw_series(cairo_t* c, const Panel& panel, double left, double top) {
  const std::vector<Style> style = styles(panel.chart);
  const std::vector<std::vector<Point>> points = points_of(panel);
  cairo_save(c);
  cairo_translate(c, left, top);
  for (std::size_t k = 0; k < style.size(); ++k) {
    cairo_save(c);
    draw_curve(c, panel, panel.chart.series[k], points[k], style[k]);
    cairo_restore(c);
  }
  draw_names(c, panel, points, style);
  draw_notes(c, panel, points, style);
  cairo_restore(c);
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
    for (const Series& s : chart.series) {
      words += ' ' + s.label;
      if (!s.notes.empty()) words += fmt::format(" ({})", fmt::join(s.notes, ", "));
      words += ';';
    }
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
    for (const Series& s : panel.chart.series) right = std::max(right, text_width(measure.get(), name_of(panel, s) + "  "));
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
