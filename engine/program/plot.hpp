// engine/program/plot.hpp
// Line charts for people: one or several panels, stacked in one picture, drawn by Cairo as SVG or PNG.
//
// reads   x, y of each series, in the units that the axis labels name; x usually ascends, but need not
// writes  FILE.svg or FILE.png, whole or not at all: a temporary file beside the target is renamed onto it
// size    the drawing is made of at most four points per series and pixel column (see thinned), so a million samples
//         make an SVG of some 50 kB. A curve that doubles back too often for that is embedded as an image.
// gaps    NaN, infinities, magnitudes from 1e300 and, on a log axis, values <= 0 are not drawn and break the line
// ranges  come from the data. A constant gets room on both sides; when the values agree in so many digits that tick
//         labels would grow long, ticks count from a round value that is named in the axis label.
// notes   stand beside their points where no marker and no other note is in the way
// styles  go by the position of the series in its panel: colours of different lightness, dashes, marker shapes.
//         Text in an SVG is outlines; the words stand once more in its <title> and <desc>, for search and for screen
//         readers.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace linden::plot {

enum class Mark {
  line,
  points,  // for measurements without order
  both,    // for few measurements along a parameter
  guide,   // thin grey dots: a nominal slope, a tolerance
};

struct Series {
  std::string label;  // stands at the end of the line; empty for none
  std::vector<double> x, y;
  Mark mark = Mark::line;
  std::vector<std::string> notes{};  // beside each point, such as its step; those that have no room are left out. Empty: none
};

struct Axis {
  std::string label;  // with its unit: "time [s]"
  bool log = false;
};

struct Chart {
  std::string title;
  std::string subtitle;  // the facts: model, step, solver, machine
  Axis x, y;
  std::vector<Series> series;
};

/// Draws the panels from top to bottom. Throws std::runtime_error that names the file and what to do: for an ending other
/// than .svg or .png, a folder that is missing or not writable, a panel without a point to draw, unequal x, y and notes.
void draw(const std::string& file, std::span<const Chart> panels);
void draw(const std::string& file, const Chart& chart);

struct Point {
  double x, y;
};

/// Of each stretch of consecutive points within one column (floor(x / column)) keeps the first, lowest, highest and last,
/// in order: the line drawn through them covers the same pixels. A point that is not finite breaks the line and comes
/// out as one NaN point, unless the gap lies within a column, where nobody could see it.
std::vector<Point> thinned(std::span<const Point> points, double column);

}  // namespace linden::plot
