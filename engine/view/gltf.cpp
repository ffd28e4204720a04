#include "engine/view/gltf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "engine/queries/link_motion.hpp"
#include "engine/text.hpp"
#include "engine/view/glb.hpp"
#include "engine/view/gltf_drawing.hpp"
#include "engine/view/gltf_motion.hpp"

namespace linden {
namespace {

using Json = nlohmann::ordered_json;

std::string refusal(const Animation& animation, std::uint64_t most_bytes) {
  return fmt::format("{} of {} with {} do not fit into one glTF file of at most {}: write fewer frames or instances",
                     counted(static_cast<std::int64_t>(animation.frames()), "frame"), counted(animation.instances, "instance"),
                     counted(static_cast<std::int64_t>(animation.bodies.size()), "body"), memory_text(most_bytes));
}

class GltfWriter {
 public:
  GltfWriter(const Animation& animation, const GltfOptions& options)
      : animation_(animation),
        most_bytes_(std::min<std::uint64_t>(options.most_bytes, std::numeric_limits<std::uint32_t>::max())),
        room_(most_bytes_, refusal(animation, most_bytes_)),
        drawing_(animation, options, numbers_, room_),
        motion_(gltf_motion_of(animation)) {
    add_tracks();
    add_nodes();
  }

  std::string file() const;

 private:
  void add_tracks();
  void add_channel(std::size_t node, const char* path, const char* type);
  void add_nodes();
  void add_instance(std::int64_t instance);
  void add_body(std::size_t track, const std::string& name, std::pair<std::size_t, std::size_t> children);
  void add_part(const GltfPart& part, const std::string& prefix);
  std::string json() const;
  void append_motion(std::string& file) const;

  /// Nodes in their order: the world; of each instance itself, its bodies, its parts; the parts of the ground.
  std::size_t nodes_of_instance() const { return 1 + animation_.bodies.size() + drawing_.parts().size(); }
  std::size_t node_of(std::int64_t instance) const { return 1 + static_cast<std::size_t>(instance) * nodes_of_instance(); }
  std::size_t node_of_body(std::size_t track) const {
    return node_of(static_cast<std::int64_t>(track / animation_.bodies.size())) + 1 + track % animation_.bodies.size();
  }

  const Animation& animation_;
  std::uint64_t most_bytes_;
  GlbRoom room_;
  GlbNumbers numbers_{room_};
  GltfDrawing drawing_;
  GltfMotion motion_;
  std::size_t times_ = 0;  // accessor
  GlbList nodes_{room_}, samplers_{room_}, channels_{room_};
};

// What moves

void GltfWriter::add_tracks() {
  for (std::size_t track = 0; track < motion_.tracks.size(); ++track) {
    const GltfTrack& moving = motion_.tracks[track];
    if ((moving.turns || moving.shifts) && channels_.empty()) {
      const Json bounds{{"min", Json::array({motion_.times.front()})}, {"max", Json::array({motion_.times.back()})}};
      times_ = numbers_.add(GlbNumbers::motion, GlbNumbers::Component::real, "SCALAR", motion_.times.size(), bounds);
    }
    if (moving.turns) add_channel(node_of_body(track), "rotation", "VEC4");
    if (moving.shifts) add_channel(node_of_body(track), "translation", "VEC3");
  }
}

void GltfWriter::add_channel(std::size_t node, const char* path, const char* type) {
  const std::size_t output = numbers_.add(GlbNumbers::motion, GlbNumbers::Component::real, type, motion_.times.size(), {});
  const std::size_t sampler = samplers_.add({{"input", times_}, {"output", output}});
  channels_.add({{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}});
}

// Nodes

Json::array_t node_indices(std::size_t begin, std::size_t end) {
  Json::array_t indices;
  for (; begin < end; ++begin) indices.emplace_back(begin);
  return indices;
}

/// Translation, rotation and scale as far as they are not what glTF takes where they are missing.
template <class Number>
void place_node(Json& node, const std::array<Number, 3>& place, const std::array<Number, 4>& rotation) {
  if (place != std::array<Number, 3>{}) node["translation"] = place;
  if (rotation != std::array<Number, 4>{0, 0, 0, 1}) node["rotation"] = rotation;
}

void GltfWriter::add_nodes() {
  std::vector<std::size_t> children;
  for (std::int64_t instance = 0; instance < animation_.instances; ++instance) children.push_back(node_of(instance));
  for (std::size_t k = 0; k < drawing_.ground().size(); ++k) children.push_back(node_of(animation_.instances) + k);
  Json world{{"name", "world, z up"}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}};
  if (!children.empty()) world["children"] = children;
  nodes_.add(world);
  for (std::int64_t instance = 0; instance < animation_.instances; ++instance) add_instance(instance);
  for (const GltfPart& part : drawing_.ground()) add_part(part, "");
}

void GltfWriter::add_instance(std::int64_t instance) {
  const bool several = animation_.instances > 1;
  const std::string prefix = several ? fmt::format("{} ", instance) : "";
  const std::size_t bodies = animation_.bodies.size(), first_track = static_cast<std::size_t>(instance) * bodies;
  const std::size_t first_body = node_of(instance) + 1, first_part = first_body + bodies;
  const auto end_of_slot = [&](std::size_t slot) {
    const auto end = std::ranges::upper_bound(drawing_.parts(), static_cast<Index>(slot), {}, slot_of);
    return first_part + static_cast<std::size_t>(end - drawing_.parts().begin());
  };
  Json node;
  node["name"] = several ? fmt::format("instance {}", instance) : plain_name(animation_.title);
  const Json::array_t children = node_indices(first_body, end_of_slot(0));  // the bodies and, right behind them, what is fixed to the world
  if (!children.empty()) node["children"] = children;
  nodes_.add(node);
  for (std::size_t body = 0; body < bodies; ++body) {
    add_body(first_track + body, prefix + animation_.bodies[body], {end_of_slot(body), end_of_slot(body + 1)});
  }
  for (const GltfPart& part : drawing_.parts()) add_part(part, prefix);
}

void GltfWriter::add_body(std::size_t track, const std::string& name, std::pair<std::size_t, std::size_t> children) {
  Json node;
  node["name"] = plain_name(name);
  place_node(node, motion_.tracks[track].place, motion_.tracks[track].rotation);
  if (children.first < children.second) node["children"] = node_indices(children.first, children.second);
  nodes_.add(node);
}

void GltfWriter::add_part(const GltfPart& written, const std::string& prefix) {
  const std::array<double, 7> pose = position_and_quaternion(written.part->pose);
  const double length = std::hypot(std::hypot(pose[3], pose[4]), std::hypot(pose[5], pose[6]));
  Json node{{"name", plain_name(prefix + written.name)}, {"mesh", written.mesh}};
  place_node<double>(node, {pose[0], pose[1], pose[2]}, {pose[3] / length, pose[4] / length, pose[5] / length, pose[6] / length});
  if (written.part->scale != std::array<double, 3>{1, 1, 1}) node["scale"] = written.part->scale;
  nodes_.add(node);
}

// The file

std::string GltfWriter::json() const {
  const std::string title = plain_name(animation_.title);
  std::string text = R"({"asset":{"version":"2.0","generator":"linden"},"scene":0,"scenes":[)";
  text += json_text({{"name", title}, {"nodes", Json::array({0})}}) + ']';
  nodes_.append_to(text, "nodes");
  drawing_.append_to(text);
  if (!channels_.empty()) {
    text += R"(,"animations":[{"name":)" + json_text(title);
    samplers_.append_to(text, "samplers");
    channels_.append_to(text, "channels");
    text += "}]";
  }
  numbers_.append_to(text);
  return text + '}';
}

void GltfWriter::append_motion(std::string& file) const {
  if (!channels_.empty()) append_as_it_is<float>(file, motion_.times);
  for (std::size_t track = 0; track < motion_.tracks.size(); ++track) {
    if (motion_.tracks[track].turns) {
      for (const std::array<float, 4>& rotation : rotations_of(animation_, motion_, track)) append_as_it_is<float>(file, rotation);
    }
    if (motion_.tracks[track].shifts) {
      for (const std::array<float, 3>& place : places_of(animation_, motion_, track)) append_as_it_is<float>(file, place);
    }
  }
}

std::string GltfWriter::file() const {
  std::string text = json();
  GlbRoom(most_bytes_, refusal(animation_, most_bytes_)).take(glb_length(text.size(), numbers_.bytes()));
  std::string bytes = glb_head(std::move(text), numbers_.bytes());
  drawing_.append_numbers(bytes);
  append_motion(bytes);
  return bytes;
}

}  // namespace

std::string glb_of(const Animation& animation, const GltfOptions& options) { return GltfWriter(animation, options).file(); }

}  // namespace linden
