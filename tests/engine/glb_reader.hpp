// A reader of binary glTF files, written from the specification and knowing nothing of the writer.
#pragma once

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace linden {

class Glb {
 public:
  using Json = nlohmann::json;
  using Rows = std::vector<std::vector<double>>;  // [count][numbers of an element]

  explicit Glb(std::string_view file) {
    REQUIRE(file.size() >= 20);
    CHECK(file.substr(0, 4) == "glTF");
    CHECK(word(file, 4) == 2);
    REQUIRE(word(file, 8) == file.size());
    REQUIRE(file.size() % 4 == 0);
    const std::size_t length = word(file, 12);
    CHECK(file.substr(16, 4) == "JSON");
    CHECK(length % 4 == 0);
    REQUIRE(20 + length <= file.size());
    text = file.substr(20, length);
    json = Json::parse(text);
    if (20 + length < file.size()) {
      REQUIRE(28 + length <= file.size());
      CHECK(file.substr(24 + length, 4) == std::string_view("BIN\0", 4));
      REQUIRE(word(file, 20 + length) == file.size() - 28 - length);
      binary = file.substr(28 + length);
      CHECK(json["buffers"][0]["byteLength"] == binary.size());
    } else {
      CHECK_FALSE(json.contains("buffers"));
    }
    for (std::size_t k = 0; k < json["nodes"].size(); ++k) {
      named_.emplace(node(k)["name"], k);
      for (const std::size_t child : node(k).value("children", std::vector<std::size_t>{})) {
        INFO("node " << child << " has one parent");
        REQUIRE(parents_.emplace(child, k).second);
      }
    }
    for (std::size_t k = 0; json.contains("animations") && k < json["animations"][0]["channels"].size(); ++k) {
      const Json& target = json["animations"][0]["channels"][k]["target"];
      const bool added = channels_.emplace(std::pair(target["node"].get<std::size_t>(), target["path"].get<std::string>()), k).second;
      CHECK(added);
    }
  }

  Json json;
  std::string text;    // of the JSON
  std::string binary;

  const Json& node(std::size_t index) const { return json["nodes"][index]; }
  std::size_t node_named(const std::string& name) const {
    INFO("nodes called " << name);
    REQUIRE(named_.count(name) == 1);
    return named_.find(name)->second;
  }

  Rows accessor(std::size_t index) const {
    const Json& accessor = json["accessors"][index];
    const Json& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::string type = accessor["type"];
    const std::size_t width = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 0;
    const std::size_t count = accessor["count"], stride = view.value("byteStride", 4 * width);
    const std::size_t offset = view.value("byteOffset", std::size_t{0}) + accessor.value("byteOffset", std::size_t{0});
    REQUIRE(width > 0);
    REQUIRE(count > 0);
    REQUIRE(offset % 4 == 0);
    REQUIRE(accessor.value("byteOffset", std::size_t{0}) + stride * (count - 1) + 4 * width <= view["byteLength"].get<std::size_t>());
    REQUIRE(view.value("byteOffset", std::size_t{0}) + view["byteLength"].get<std::size_t>() <= binary.size());
    Rows rows(count, std::vector<double>(width));
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t j = 0; j < width; ++j) rows[k][j] = number(accessor["componentType"], offset + k * stride + 4 * j);
    }
    return rows;
  }

  /// Output of a node's channel; nothing where it has none.
  std::optional<Rows> channel(std::size_t node, const std::string& path) const {
    const auto found = channels_.find({node, path});
    if (found == channels_.end()) return {};
    const Json& animation = json["animations"][0];
    const Json& sampler = animation["samplers"][animation["channels"][found->second]["sampler"].get<std::size_t>()];
    CHECK(sampler.value("interpolation", "LINEAR") == "LINEAR");
    return accessor(sampler["output"]);
  }
  std::vector<double> times() const {
    std::vector<double> times;
    for (const auto& row : accessor(json["animations"][0]["samplers"][0]["input"])) times.push_back(row[0]);
    return times;
  }

  /// From the node to its parent, at a frame of the animation.
  Eigen::Affine3d local(std::size_t index, std::size_t frame) const {
    const auto numbers = [&](const char* path, std::vector<double> otherwise) {
      if (const auto rows = channel(index, path)) return rows->at(frame);
      return node(index).value(path, std::move(otherwise));
    };
    const std::vector<double> t = numbers("translation", {0, 0, 0}), r = numbers("rotation", {0, 0, 0, 1}), s = numbers("scale", {1, 1, 1});
    Eigen::Affine3d place = Eigen::Affine3d::Identity();
    place.translate(Eigen::Vector3d(t[0], t[1], t[2])).rotate(Eigen::Quaterniond(r[3], r[0], r[1], r[2]));
    return place.scale(Eigen::Vector3d(s[0], s[1], s[2]));
  }
  /// From the node to the world of glTF.
  Eigen::Affine3d world(std::size_t index, std::size_t frame) const {
    Eigen::Affine3d place = local(index, frame);
    for (auto up = parent_of(index); up; up = parent_of(*up)) place = local(*up, frame) * place;
    return place;
  }
  std::optional<std::size_t> parent_of(std::size_t index) const {
    const auto found = parents_.find(index);
    return found == parents_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  static std::size_t word(std::string_view bytes, std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  }
  double number(int component, std::size_t at) const {
    if (component == 5125) return static_cast<double>(word(binary, at));
    REQUIRE(component == 5126);
    float value;
    std::memcpy(&value, binary.data() + at, sizeof value);
    return static_cast<double>(value);
  }

  std::map<std::pair<std::size_t, std::string>, std::size_t> channels_;
  std::multimap<std::string, std::size_t> named_;
  std::map<std::size_t, std::size_t> parents_;
};

}  // namespace linden
