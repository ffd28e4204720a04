#include "engine/view/page.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string_view>

#include "engine/view/base64.hpp"
#include "engine/view/live.hpp"
#include "engine/view/page_template.hpp"

namespace linden {
namespace {

/// The sections one after the other, each from a multiple of four bytes.
class Sections {
 public:
  template <class T>
  void add(std::span<const T> numbers) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    if (!numbers.empty()) bytes_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
  }
  template <class T>
  void add(const std::vector<T>& numbers) {
    add(std::span<const T>(numbers));
  }

  /// As one zlib stream.
  std::string packed() const {
    uLongf size = compressBound(bytes_.size());
    std::string packed(size, '\0');
    // level 6: 9 takes four times as long for two hundredths less
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes_.data()), bytes_.size(), 6) != Z_OK) {
      throw std::runtime_error("the data of the page cannot be packed: there is not enough memory; show fewer frames (--fps)");
    }
    packed.resize(size);
    return packed;
  }

 private:
  std::string bytes_;
};

/// Numbers of one body over time become differences.
template <class T>
T difference(T& before, T now) {
  const T result = static_cast<T>(now - before);
  before = now;
  return result;
}

/// Where all bodies are, on a grid and by three components of their quaternions.
class PackedPoses {
 public:
  explicit PackedPoses(const Animation& animation) : animation_(animation), each_(animation.poses.size() / 7) {
    find_bounds();
    find_grid();
    place();
    turn();
  }

  /// x, y, z of the least place, and a step [m].
  const std::array<double, 4>& grid() const { return grid_; }

  void add_to(Sections& sections) const {
    sections.add(bounds_);
    sections.add(low_);
    sections.add(high_);
    sections.add(rotations_);
    sections.add(largest_);
  }

 private:
  void find_bounds() {
    const std::size_t bodies = animation_.bodies.size();
    for (std::int64_t instance = 0; instance < animation_.instances; ++instance) {
      std::array<float, 3> least{}, most{};
      bool first = true;
      for (std::size_t frame = 0; frame < animation_.frames(); ++frame) {
        for (std::size_t b = 0; b < bodies; ++b) {
          const float* const place = &animation_.poses[animation_.pose_at(frame, instance, b) + 4];
          for (std::size_t k = 0; k < 3; ++k) {
            least[k] = first ? place[k] : std::min(least[k], place[k]);
            most[k] = first ? place[k] : std::max(most[k], place[k]);
          }
          first = false;
        }
      }
      bounds_.insert(bounds_.end(), least.begin(), least.end());
      for (std::size_t k = 0; k < 3; ++k) bounds_.push_back(most[k] - least[k]);
    }
  }

  /// Fine enough for what is small in a large world: a 65,535th of the extent, and a tenth of a millimetre, whatever is less.
  void find_grid() {
    std::array<double, 3> least{}, most{};
    for (std::size_t at = 0; at < bounds_.size(); ++at) {
      const std::size_t k = at % 3, of = at / 6 * 6 + k;
      if (at % 6 < 3) least[k] = at < 6 ? bounds_[at] : std::min(least[k], static_cast<double>(bounds_[at]));
      else most[k] = std::max(at < 6 ? least[k] : most[k], static_cast<double>(bounds_[of]) + bounds_[at]);
    }
    const double extent = std::max({most[0] - least[0], most[1] - least[1], most[2] - least[2]});
    constexpr double kFinest = 1e-4, kSteps = 4e9;
    grid_ = {least[0], least[1], least[2], std::max({std::min(kFinest, extent / 65535), extent / kSteps, 1e-30})};
  }

  void place() {
    const std::size_t bodies = static_cast<std::size_t>(animation_.instances) * animation_.bodies.size();
    low_.resize(3 * each_);
    high_.resize(3 * each_);
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<std::uint32_t> before(bodies);
      for (std::size_t n = 0; n < each_; ++n) {
        const double place = animation_.poses[n * 7 + 4 + k];
        const auto now = static_cast<std::uint32_t>(std::llround((place - grid_[k]) / grid_[3]));
        const std::uint32_t step = difference(before[n % bodies], now);
        low_[k * each_ + n] = static_cast<std::uint16_t>(step);
        high_[k * each_ + n] = static_cast<std::uint16_t>(step >> 16);
      }
    }
  }

  void turn() {
    const std::size_t bodies = static_cast<std::size_t>(animation_.instances) * animation_.bodies.size();
    rotations_.resize(3 * each_);
    largest_.resize(each_);
    std::vector<std::array<std::uint16_t, 3>> before(bodies);
    for (std::size_t n = 0; n < each_; ++n) {
      const float* const q = &animation_.poses[n * 7];
      std::size_t largest = 0;
      for (std::size_t k = 1; k < 4; ++k) {
        if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
      }
      largest_[n] = static_cast<std::uint8_t>(largest);
      const double sign = q[largest] < 0 ? -1 : 1;
      std::size_t to = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        if (k == largest) continue;
        const double part = std::clamp(sign * static_cast<double>(q[k]) * std::numbers::sqrt2, -1.0, 1.0);
        const auto now = static_cast<std::uint16_t>(std::lround((part + 1) / 2 * 65535));
        rotations_[to * each_ + n] = difference(before[n % bodies][to], now);
        ++to;
      }
    }
  }

  const Animation& animation_;
  std::size_t each_;  // poses in all
  std::vector<float> bounds_;
  std::array<double, 4> grid_{};
  std::vector<std::uint16_t> low_, high_, rotations_;
  std::vector<std::uint8_t> largest_;
};

void add_parts(const Drawing& drawing, Sections& sections) {
  std::vector<std::int32_t> slots;
  std::vector<std::uint32_t> meshes, layers;
  std::vector<float> places, colours;
  for (const DrawnPart& part : drawing.parts) {
    slots.push_back(part.slot);
    meshes.push_back(part.mesh);
    layers.push_back(static_cast<std::uint32_t>(part.layer));
    for (std::size_t column = 0; column < 3; ++column) {
      for (std::size_t row = 0; row < 3; ++row) {
        places.push_back(static_cast<float>(part.pose.rotation[3 * row + column] * part.scale[column]));
      }
      places.push_back(0);
    }
    for (const double shift : part.pose.shift) places.push_back(static_cast<float>(shift));
    places.push_back(1);
    colours.insert(colours.end(), part.colour.begin(), part.colour.end());
  }
  sections.add(slots);
  sections.add(meshes);
  sections.add(layers);
  sections.add(places);
  sections.add(colours);
  for (const TriangleMesh& mesh : drawing.meshes) {
    sections.add(mesh.positions);
    sections.add(mesh.normals);
    sections.add(mesh.indices);
  }
}

struct Range {
  float least = 0, most = 0;
};

Range range_of(const Curve& curve) {
  Range range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (const float value : curve.values) {
    if (!std::isfinite(value)) continue;
    range.least = std::min(range.least, value);
    range.most = std::max(range.most, value);
  }
  return range.least <= range.most ? range : Range{};
}

void add_curves(const Animation& animation, const std::vector<Range>& ranges, Sections& sections) {
  std::vector<std::uint16_t> packed;
  for (std::size_t c = 0; c < animation.curves.size(); ++c) {
    const double least = ranges[c].least, extent = ranges[c].most - least;
    std::uint16_t before = 0;
    for (const float value : animation.curves[c].values) {
      const double part = extent > 0 ? (static_cast<double>(value) - least) / extent : 0;
      const auto now = static_cast<std::uint16_t>(std::isfinite(value) ? 1 + std::lround(part * 65534) : 0);
      packed.push_back(difference(before, now));
    }
  }
  sections.add(packed);
}

void add_forces(const Animation& animation, Sections& sections) {
  std::vector<std::uint32_t> counts(animation.frames());
  std::vector<float> forces;
  for (std::size_t frame = 0; frame < counts.size(); ++frame) {
    counts[frame] = static_cast<std::uint32_t>(animation.forces[frame].size());
    for (const DrawnForce& force : animation.forces[frame]) {
      forces.push_back(static_cast<float>(force.instance));
      forces.push_back(static_cast<float>(force.slot - 1));
      forces.insert(forces.end(), force.place.begin(), force.place.end());
      forces.insert(forces.end(), force.force.begin(), force.force.end());
    }
  }
  sections.add(counts);
  sections.add(forces);
}

nlohmann::ordered_json header_of(const Animation& animation, const std::vector<Range>& ranges, const std::array<double, 4>& grid) {
  nlohmann::ordered_json meshes = nlohmann::ordered_json::array(), links = meshes, curves = meshes;
  for (const TriangleMesh& mesh : animation.drawing.meshes) {
    meshes.push_back({{"points", mesh.positions.size() / 3}, {"triangles", mesh.indices.size() / 3}});
  }
  for (const DrawnPart& part : animation.drawing.parts) links.push_back(part.link);
  nlohmann::ordered_json lines = nlohmann::ordered_json::array();
  for (const DrawnLine& line : animation.lines) {
    nlohmann::ordered_json points = nlohmann::ordered_json::array();
    for (const DrawnLine::Point& point : line.points) points.push_back({point.slot, point.place[0], point.place[1], point.place[2]});
    lines.push_back({{"name", line.name}, {"points", points}});
  }
  for (std::size_t c = 0; c < animation.curves.size(); ++c) {
    const Curve& curve = animation.curves[c];
    curves.push_back({{"group", curve.group},
                      {"name", curve.name},
                      {"unit", curve.unit},
                      {"body", curve.slot - 1 < 0 ? -1 : curve.slot - 1},
                      {"instance", curve.instance},
                      {"least", ranges[c].least},
                      {"most", ranges[c].most}});
  }
  return {{"format", 1},
          {"title", animation.title},
          {"instances", animation.instances},
          {"frames", animation.frames()},
          {"bodies", animation.bodies},
          {"joints", animation.joints},
          {"parents", animation.parents},
          {"parts", animation.drawing.parts.size()},
          {"meshes", meshes},
          {"links", links},
          {"lines", lines},
          {"curves", curves},
          {"grid", grid},
          {"error", {{"place", grid[3] * std::numbers::sqrt3 / 2}, {"angle", kAngleError}}},
          {"notes", animation.notes}};
}

nlohmann::ordered_json live_json(const LiveFacts& live) {
  nlohmann::ordered_json servos = nlohmann::ordered_json::array();
  for (const LiveServo& servo : live.servos) {
    servos.push_back({{"name", servo.name}, {"unit", servo.unit}, {"least", servo.least}, {"most", servo.most}});
  }
  return {{"session", live.session}, {"step", live.step}, {"forces", live.most_forces}, {"weight", live.weight}, {"servos", servos}};
}

/// JSON that no HTML can be read in: a tag begins with <.
std::string safe_json(const nlohmann::ordered_json& json) {
  const std::string text = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

/// live: of a simulation that runs on from there; null: none does.
std::string page_with(const Animation& animation, const LiveFacts* live) {
  const std::string_view page = page_template();
  constexpr std::string_view kPlace = "<!-- linden data -->";
  const std::size_t at = page.find(kPlace);
  if (at == page.npos) {
    throw std::runtime_error("this build of linden has no page to show a motion in; build it with -DLINDEN_VIEW=ON (needs node and npm)");
  }
  if (animation.times.empty()) throw std::runtime_error("a motion without a frame cannot be shown; add one");
  std::vector<float> times;
  for (const double time : animation.times) times.push_back(static_cast<float>(time - animation.times.front()));
  std::vector<Range> ranges;
  for (const Curve& curve : animation.curves) ranges.push_back(range_of(curve));
  const PackedPoses poses(animation);

  Sections sections;
  sections.add(times);
  add_parts(animation.drawing, sections);
  poses.add_to(sections);
  add_curves(animation, ranges, sections);
  add_forces(animation, sections);

  std::string result(page.substr(0, at));
  result += "<script type=\"application/json\" id=\"linden-header\">";
  nlohmann::ordered_json header = header_of(animation, ranges, poses.grid());
  if (live) header["live"] = live_json(*live);
  result += safe_json(header);
  result += "</script>\n<script type=\"application/octet-stream;base64\" id=\"linden-data\">";
  result += base64(sections.packed());
  result += "</script>";
  result += page.substr(at + kPlace.size());
  return result;
}

}  // namespace

std::string page_of(const Animation& animation) { return page_with(animation, nullptr); }

std::string live_page_of(const Animation& start, const LiveFacts& live) { return page_with(start, &live); }

}  // namespace linden
