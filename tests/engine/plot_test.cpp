// Pictures appear whole or not at all, say what they show, and keep a spike of a single sample.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "engine/program/plot.hpp"
#include "engine/program/plot_pen.hpp"
#include "engine/program/plot_scale.hpp"
#include "tests/engine/folder.hpp"

namespace linden::plot_test {
namespace {

namespace fs = std::filesystem;

plot::Chart wave(std::size_t samples) {
  plot::Series series{.label = "sine", .x = {}, .y = {}};
  for (std::size_t k = 0; k < samples; ++k) {
    series.x.push_back(static_cast<double>(k));
    series.y.push_back(std::sin(1e-3 * static_cast<double>(k)));
  }
  return {"A wave", "of a test", {"time [s]"}, {"height [m]"}, {series}};
}

TEST_CASE("a chart becomes an SVG or a PNG by its ending, and nothing else is left in the folder") {
  const Folder folder;
  plot::draw(folder.file("wave.svg"), wave(1000));
  plot::draw(folder.file("wave.png"), wave(1000));
  const std::string svg = text_of(folder.file("wave.svg"));
  CHECK_THAT(svg, Catch::StartsWith("<?xml"));
  for (const char* word : {"A wave", "time [s]", "height [m]", "sine"}) CHECK_THAT(svg, Catch::Contains(word));
  CHECK(text_of(folder.file("wave.png")).substr(1, 3) == "PNG");
  CHECK(folder.files() == std::set<std::string>{"wave.png", "wave.svg"});
}

TEST_CASE("a million samples make a small file") {
  const Folder folder;
  plot::draw(folder.file("long.svg"), wave(1'000'000));
  CHECK(fs::file_size(folder.file("long.svg")) < 500'000);
}

TEST_CASE("thinning keeps the extremes of every column and the gaps between") {
  std::vector<plot::Point> points;
  for (int k = 0; k < 1000; ++k) points.push_back({static_cast<double>(k), k == 456 ? 7.0 : k == 700 ? -3.0 : 0.0});
  points[800].y = std::nan("");
  const std::vector<plot::Point> kept = plot::thinned(points, 100);
  CHECK(kept.size() <= 44);
  CHECK(std::ranges::count_if(kept, [](const plot::Point& p) { return p.x == 456 && p.y == 7; }) == 1);
  CHECK(std::ranges::count_if(kept, [](const plot::Point& p) { return p.x == 700 && p.y == -3; }) == 1);
}

TEST_CASE("numbers that cannot be drawn break the line and nothing else") {
  const Folder folder;
  plot::Chart chart = wave(100);
  chart.series[0].y[50] = std::nan("");
  chart.series[0].y[60] = std::numeric_limits<double>::infinity();
  CHECK_NOTHROW(plot::draw(folder.file("gap.svg"), chart));
  chart.y.log = true;  // half of a sine is negative
  CHECK_NOTHROW(plot::draw(folder.file("log.svg"), chart));
  for (double& y : chart.series[0].y) y = 42;
  CHECK_NOTHROW(plot::draw(folder.file("constant.png"), chart));
}

std::vector<std::string> labels(const plot::Scale& scale) {
  std::vector<std::string> result;
  for (const plot::Tick& tick : scale.ticks) {
    if (!tick.label.empty()) result.push_back(tick.label);
  }
  return result;
}

TEST_CASE("a log axis has a labelled tick every decade, minor ones between, all where their values lie") {
  const plot::Scale scale = plot::make_scale({"time [s]", true}, 1, 10'000, 0, 0.1);
  CHECK(labels(scale) == std::vector<std::string>{"1", "10", "100", "1000", "10000"});
  CHECK(scale.ticks.size() == 4 * 9 + 1);
  for (int k = 0; k <= 4; ++k) {
    CHECK(scale(std::pow(10, k)) == Approx(0.25 * k).margin(1e-12));
    CHECK(scale.ticks[static_cast<std::size_t>(9 * k)].at == Approx(0.25 * k).margin(1e-12));
  }
  CHECK(std::ranges::is_sorted(scale.ticks, {}, &plot::Tick::at));
  CHECK(std::isnan(scale(0)));
  CHECK(std::isnan(scale(-1)));
}

TEST_CASE("a log axis of many decades labels only some, and of few more than the decades") {
  CHECK(labels(plot::make_scale({"", true}, 1e-12, 1, 0, 0.2)).size() == 5);
  CHECK(labels(plot::make_scale({"", true}, 10, 100, 0, 0.1)) == std::vector<std::string>{"10", "20", "50", "100"});
}

TEST_CASE("a log axis with room for it labels every decade") {
  // the axes of a panel of 210 pixels: 17 for a label
  CHECK(labels(plot::make_scale({"", true}, 1e-10, 1, 0, 17.0 / 210)) ==
        std::vector<std::string>{"1e\u221210", "1e\u22129", "1e\u22128", "1e\u22127", "1e\u22126", "1e\u22125", "1e\u22124", "1e\u22123", "1e\u22122", "1e\u22121", "1"});
}

TEST_CASE("notes stand beside their points, on no marker, on no other note and within the axes") {
  const plot::Point area{100, 60};
  const std::vector<plot::Point> points{{20, 30}, {20, 30}, {97, 30}, {3, 3}, {50, 58}, {std::nan(""), 10}};
  std::vector<plot::Note> notes;
  for (const plot::Point& point : points) notes.push_back({point, 12, 7});
  const std::vector<plot::Point> places = plot::note_places(notes, points, area);
  REQUIRE(places.size() == points.size());
  CHECK((places[0].x > 20 && places[0].y < 30));  // right above
  CHECK((places[1].x + 12 < 20 && places[1].y < 30));  // where the first has taken that, left
  CHECK((places[2].x + 12 < 97 && places[2].y < 30));  // at the right edge, left
  CHECK((places[3].x > 3 && places[3].y - 7 > 3));  // at the upper edge, below
  CHECK((places[4].x > 50 && places[4].y < 58));  // at the lower edge, above
  CHECK(std::isnan(places[5].x));  // a point that is not drawn has no note
}

TEST_CASE("a note without room is left out") {
  const std::vector<plot::Point> crowd{{20, 30}, {26, 24}, {14, 24}, {26, 36}, {14, 36}};
  const std::vector<plot::Point> places = plot::note_places({{crowd[0], 12, 7}}, crowd, {100, 60});
  REQUIRE(places.size() == 1);
  CHECK(std::isnan(places[0].x));
}

TEST_CASE("the words of a picture have its notes, and notes of another number than the points are refused") {
  const Folder folder;
  plot::Chart chart = wave(3);
  chart.series[0].mark = plot::Mark::both;
  chart.series[0].notes = {"16", "8", "4"};
  plot::draw(folder.file("notes.svg"), chart);
  CHECK_THAT(text_of(folder.file("notes.svg")), Catch::Contains("sine (16, 8, 4);"));
  chart.series[0].notes.pop_back();
  CHECK_THROWS_WITH(plot::draw(folder.file("fewer.svg"), chart), Catch::Contains("3 points and 2 notes"));
}

TEST_CASE("what cannot be drawn is refused with the reason, and no file appears") {
  const Folder folder;
  CHECK_THROWS_WITH(plot::draw(folder.file("wave.jpg"), wave(10)), Catch::Contains(".svg or .png"));
  CHECK_THROWS_WITH(plot::draw(folder.file("no/wave.svg"), wave(10)), Catch::Contains("no folder"));
  plot::Chart empty = wave(10);
  empty.series.clear();
  CHECK_THROWS_WITH(plot::draw(folder.file("empty.svg"), empty), Catch::Contains("A wave"));
  plot::Chart start_excess = wave(10);
  start_excess.series[0].y.pop_back();
  CHECK_THROWS(plot::draw(folder.file("start_excess.svg"), start_excess));
  CHECK(folder.files().empty());
}

}  // namespace
}  // namespace linden::plot_test
