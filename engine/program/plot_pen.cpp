// engine/program/plot_pen.cpp
// In order: text and where it goes, lines, markers.
#include "engine/program/plot_pen.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

namespace linden::plot {
namespace {

// lightness L* 21, 49, 62, 38, 58, 33: neighbours differ in print without colour and to colour-blind eyes
constexpr std::array<Colour, 6> palette{{{0.063, 0.192, 0.420},
                                         {0.800, 0.294, 0.086},
                                         {0.180, 0.620, 0.760},
                                         {0.500, 0.250, 0.560},
                                         {0.680, 0.520, 0.040},
                                         {0.300, 0.300, 0.300}}};

constexpr std::array<Dashes, 4> dashes{{{{}, 0}, {{7, 3}, 2}, {{2, 2.2}, 2}, {{8, 2.5, 2, 2.5}, 4}}};

}  // namespace

void set_colour(cairo_t* c, Colour k) { cairo_set_source_rgb(c, k.r, k.g, k.b); }

void set_font(cairo_t* c, double size, bool bold) {
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

void show(cairo_t* c, double x, double y, const std::string& text, double align) {
  cairo_move_to(c, x - align * text_width(c, text), y);
  cairo_show_text(c, text.c_str());
}

void show_over(cairo_t* c, double x, double y, const std::string& text, Colour colour) {
  cairo_text_extents_t extents;
  cairo_text_extents(c, text.c_str(), &extents);
  cairo_set_source_rgba(c, white.r, white.g, white.b, 0.75);
  cairo_rectangle(c, eighth(x), eighth(y + extents.y_bearing), eighth(extents.x_advance), eighth(extents.height));
  cairo_fill(c);
  set_colour(c, colour);
  show(c, x, y, text);
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

std::vector<Point> note_places(const std::vector<Note>& notes, const std::vector<Point>& markers, Point area) {
  constexpr double kMarker = 4.5, kAway = 5;  // half of a marker's width; from its middle to a word
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  struct Box {
    double left, top, right, bottom;
    bool meets(const Box& other) const { return left < other.right && other.left < right && top < other.bottom && other.top < bottom; }
  };
  std::vector<Box> taken;
  for (const Point& p : markers)
    if (drawable(p)) taken.push_back({p.x - kMarker, p.y - kMarker, p.x + kMarker, p.y + kMarker});
  std::vector<Point> places;
  for (const auto& [at, width, height] : notes) {
    const double right = at.x + kAway, left = at.x - kAway - width, above = at.y - kAway, below = at.y + kAway + height;
    places.push_back({nan, nan});
    for (const Point& place : {Point{right, above}, Point{left, above}, Point{right, below}, Point{left, below}}) {
      const Box box{place.x, place.y - height, place.x + width, place.y};
      const bool within = box.left >= 0 && box.right <= area.x && box.top >= 0 && box.bottom <= area.y;
      if (!drawable(at) || !within || std::ranges::any_of(taken, [&](const Box& other) { return box.meets(other); })) continue;
      places.back() = place;
      taken.push_back(box);
      break;
    }
  }
  return places;
}

std::vector<Style> styles(const Chart& chart) {
  std::vector<Style> result;
  std::size_t k = 0;
  for (const Series& s : chart.series) {
    if (s.mark == Mark::guide) result.push_back({guide_grey, {{1.2, 2.4}, 2}, 1.1, 0});
    else result.push_back({palette[k % palette.size()], dashes[k % dashes.size()], 1.7, k % 4}), ++k;
  }
  return result;
}

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

}  // namespace linden::plot
