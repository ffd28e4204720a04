#include "models/urdf/urdf_shapes.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>

#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/urdf/urdf_numbers.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

class ShapesReader {
 public:
  ShapesReader(const UrdfLink& link, UrdfReport& report) : owner_("link " + quoted(link.name)), report_(report), numbers_(report) {}

  std::optional<LinkShape> read(const XMLElement& holder) {
    const XMLElement* geometry = holder.FirstChildElement("geometry");
    for (const XMLElement* element = geometry ? geometry->FirstChildElement() : nullptr; element; element = element->NextSiblingElement()) {
      if (std::optional<CollisionShape> shape = shape_of(*element)) return LinkShape{origin_of(holder), std::move(*shape)};
    }
    // a shape that is not known has been told already
    if (!geometry || !geometry->FirstChildElement()) {
      report_.warn(holder.GetLineNum(), fmt::format("{}: a <{}> holds no shape; left out", owner_, holder.Name()));
    }
    return std::nullopt;
  }

 private:
  std::optional<CollisionShape> shape_of(const XMLElement& element) const {
    const std::string_view tag = element.Name();
    if (tag == "sphere") return CollisionShape{ShapeKind::sphere, {length(element, "radius")}, ""};
    if (tag == "box") return CollisionShape{ShapeKind::box, edges(element), ""};
    if (tag == "cylinder" || tag == "capsule") {
      const ShapeKind kind = tag == "cylinder" ? ShapeKind::cylinder : ShapeKind::capsule;
      return CollisionShape{kind, {length(element, "radius"), length(element, "length")}, ""};
    }
    if (tag == "mesh") return mesh(element);
    return std::nullopt;
  }

  double length(const XMLElement& element, const char* name) const {
    const double value = numbers_.one(owner_, element, name);
    if (value < 0) fail_negative(element, name);
    return value;
  }

  std::array<double, 3> edges(const XMLElement& box) const {
    const std::array<double, 3> size = numbers_.three(owner_, box, "size");
    if (size[0] < 0 || size[1] < 0 || size[2] < 0) fail_negative(box, "size");
    return size;
  }

  [[noreturn]] void fail_negative(const XMLElement& element, const char* name) const {
    const auto& attribute = numbers_.attribute(owner_, element, name);
    report_.fail(attribute.GetLineNum(),
                 fmt::format("{}: <{}> has {}={}", owner_, element.Name(), name, quoted(attribute.Value())), "zero or more",
                 "correct it");
  }

  CollisionShape mesh(const XMLElement& element) const {
    const auto& file = numbers_.attribute(owner_, element, "filename");
    if (words_of(file.Value()).empty()) {
      report_.fail(file.GetLineNum(), fmt::format("{}: <mesh> has an empty filename", owner_), "the name of a file", "name it");
    }
    const bool scaled = element.FindAttribute("scale") != nullptr;
    return {ShapeKind::mesh, scaled ? numbers_.three(owner_, element, "scale") : std::array<double, 3>{1, 1, 1}, file.Value()};
  }

  Pose origin_of(const XMLElement& holder) const {
    Isometry pose = Isometry::Identity();
    const XMLElement* origin = numbers_.origin(owner_, holder);
    if (!origin) return pose_of(pose);
    if (origin->FindAttribute("xyz")) {
      const std::array<double, 3> xyz = numbers_.three(owner_, *origin, "xyz");
      pose.translation() = Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
    }
    if (origin->FindAttribute("rpy")) {
      // roll about x, pitch about y, yaw about z of the fixed axes, in this order
      const std::array<double, 3> rpy = numbers_.three(owner_, *origin, "rpy");
      using Eigen::AngleAxisd, Eigen::Vector3d;
      pose.linear() = (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) *
                       AngleAxisd(rpy[0], Vector3d::UnitX())).toRotationMatrix();
    }
    return pose_of(pose);
  }

  std::string owner_;
  UrdfReport& report_;
  UrdfNumbers numbers_;
};

}  // namespace

std::vector<LinkShape> shapes_of(const UrdfLink& link, UrdfReport& report) {
  std::vector<LinkShape> shapes;
  for (const XMLElement* holder = link.element->FirstChildElement("collision"); holder; holder = holder->NextSiblingElement("collision")) {
    if (std::optional<LinkShape> shape = shape_of(*holder, link, report)) shapes.push_back(std::move(*shape));
  }
  return shapes;
}

std::optional<LinkShape> shape_of(const XMLElement& holder, const UrdfLink& link, UrdfReport& report) {
  return ShapesReader(link, report).read(holder);
}

}  // namespace linden
