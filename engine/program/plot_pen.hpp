// engine/program/plot_pen.hpp
// Text, lines and markers of a picture: how they look, and how Cairo draws them. Lengths are in pixels of an SVG.
#pragma once

#include <cairo.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "engine/program/plot.hpp"

namespace linden::plot {

inline constexpr double plot_width = 640;  // of the area within the axes

struct Colour {
  double r, g, b;
};
inline constexpr Colour ink{0.13, 0.13, 0.13}, text_grey{0.36, 0.36, 0.36}, axis_grey{0.45, 0.45, 0.45}, guide_grey{0.52, 0.52, 0.52},
    grid_grey{0.89, 0.89, 0.89}, minor_grey{0.95, 0.95, 0.95}, white{1, 1, 1};

struct Dashes {
  std::array<double, 4> lengths;
  int count;
};

struct Style {
  Colour colour;
  Dashes dash;
  double width;
  std::size_t shape;
};

inline bool drawable(Point p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// Coordinates in eighths: finer than the eye, and short in an SVG.
inline double eighth(double v) { return std::round(8 * v) / 8; }

void set_colour(cairo_t* c, Colour k);
void set_font(cairo_t* c, double size, bool bold = false);
double text_width(cairo_t* c, const std::string& text);
/// `align` 0: the text begins at x, 0.5: is centred there, 1: ends there. y is the base line.
void show(cairo_t* c, double x, double y, const std::string& text, double align = 0);
/// The same over lines, which it dims so that they leave it readable.
void show_over(cairo_t* c, double x, double y, const std::string& text, Colour colour);
std::vector<std::string> wrapped(cairo_t* c, const std::string& text, double width);

/// Places as near as possible (least squares) to the wanted ones, at least `gap` apart, within lo … hi.
std::vector<double> spread(const std::vector<double>& wanted, double gap, double lo, double hi);

/// A word beside a point: where the point is, and how large the word is.
struct Note {
  Point at;
  double width, height;
};

/// Where each word begins, as `show` takes it: right above its point, or left of it, or below, the first of these that lies within
/// 0 … area and neither on a marker nor on a word before it. NaN where there is no such place.
std::vector<Point> note_places(const std::vector<Note>& notes, const std::vector<Point>& markers, Point area);

/// The style of each series; guides take none of the colours.
std::vector<Style> styles(const Chart& chart);

void trace(cairo_t* c, const std::vector<Point>& points, const Style& style);
void trace_markers(cairo_t* c, const std::vector<Point>& points, const Style& style);

}  // namespace linden::plot
