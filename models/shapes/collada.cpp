#include "models/shapes/collada.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>
#include <optional>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"
#include "models/shapes/collada_colours.hpp"
#include "models/urdf/xml_text.hpp"

namespace linden {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;
using tinyxml2::XMLElement;

/// More than any robot's part has, few enough to be walked in a fraction of a second.
constexpr std::size_t kMostElements = 200'000, kMostPoints = 20'000'000;

class Collada {
 public:
  Collada(const std::string& file, MeshSink& sink) : file_(file), sink_(sink) {
    const std::string text = read_text(file, "a COLLADA file");
    if (const int line = line_of_crowded_element(text); line > 0) {
      fail(fmt::format("the element in line {} has more than {} attributes", line, kMostAttributes), "a COLLADA file");
    }
    if (document_.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      fail(fmt::format("line {} is no XML", document_.ErrorLineNum()), "a COLLADA file");
    }
    root_ = document_.FirstChildElement("COLLADA");
    if (!root_) fail("its outermost element is not <COLLADA>", "a COLLADA file");
    index_ids();
  }

  void read() {
    meter_ = meters_per_unit();
    if (const XMLElement* scene = shown_scene()) {
      walk(*scene);
    } else {
      for (const XMLElement* geometry : geometries_) show(*geometry, nullptr, Affine3d::Identity());
    }
  }

 private:
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw InputError(fmt::format("{}: {}; expected {}", file_, found, expected));
  }

  /// In the order of the file, without recursion.
  void index_ids() {
    for (const XMLElement* at = root_; at;) {
      if (const char* id = at->Attribute("id")) called_.emplace(id, at);
      if (at->Name() == std::string_view("geometry")) geometries_.push_back(at);
      const XMLElement* next = at->FirstChildElement();
      while (!next && at != root_) {
        next = at->NextSiblingElement();
        if (!next) at = at->Parent()->ToElement();
      }
      at = next;
    }
  }

  /// What "#id" in an attribute stands for; nothing where it is no such element.
  const XMLElement* target_of(const XMLElement& element, const char* attribute, std::string_view tag) const {
    const char* reference = element.Attribute(attribute);
    if (!reference || reference[0] != '#') return nullptr;
    const auto found = called_.find(reference + 1);
    return found != called_.end() && found->second->Name() == tag ? found->second : nullptr;
  }

  const XMLElement* shown_scene() const {
    const XMLElement* scene = root_->FirstChildElement("scene");
    const XMLElement* instance = scene ? scene->FirstChildElement("instance_visual_scene") : nullptr;
    if (instance) {
      if (const XMLElement* shown = target_of(*instance, "url", "visual_scene")) return shown;
    }
    const XMLElement* library = root_->FirstChildElement("library_visual_scenes");
    return library ? library->FirstChildElement("visual_scene") : nullptr;
  }

  void walk(const XMLElement& scene) {
    std::size_t elements = 0;
    std::vector<std::pair<const XMLElement*, Affine3d>> open{{&scene, Affine3d::Identity()}};
    while (!open.empty()) {
      const auto [node, before] = open.back();
      open.pop_back();
      Affine3d pose = before;
      for (const XMLElement* child = node->FirstChildElement(); child; child = child->NextSiblingElement()) {
        if (++elements > kMostElements) {
          fail(fmt::format("its scene has over {} elements or shows itself", kMostElements), "a smaller scene");
        }
        const std::string_view tag = child->Name();
        if (tag == "node") {
          open.emplace_back(child, pose);
        } else if (tag == "instance_node") {
          const XMLElement* shown = target_of(*child, "url", "node");
          if (!shown) fail_reference(*child);
          open.emplace_back(shown, pose);
        } else if (tag == "instance_geometry") {
          const XMLElement* shown = target_of(*child, "url", "geometry");
          if (!shown) fail_reference(*child);
          show(*shown, child, pose);
        } else {
          pose = pose * step_of(*child, tag);
        }
      }
    }
  }

  [[noreturn]] void fail_reference(const XMLElement& instance) const {
    const char* url = instance.Attribute("url");
    fail(fmt::format("line {} shows {}", instance.GetLineNum(), quoted(url ? url : "")), "something that the file holds");
  }

  /// How an element of a node moves what comes after it; not at all, if it is no transformation.
  Affine3d step_of(const XMLElement& element, std::string_view tag) const {
    Affine3d step = Affine3d::Identity();
    if (tag == "matrix") {
      const std::array<double, 16> m = numbers<16>(element);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) step(row, column) = m[static_cast<std::size_t>(4 * row + column)];
      }
    } else if (tag == "translate") {
      const std::array<double, 3> v = numbers<3>(element);
      step = Eigen::Translation3d(v[0], v[1], v[2]);
    } else if (tag == "scale") {
      const std::array<double, 3> v = numbers<3>(element);
      step = Eigen::Scaling(v[0], v[1], v[2]);
    } else if (tag == "rotate") {
      const std::array<double, 4> turn = numbers<4>(element);  // axis, angle [deg]
      const Vector3d axis(turn[0], turn[1], turn[2]);
      if (axis.norm() > 0) step = Eigen::AngleAxisd(turn[3] * std::numbers::pi / 180, axis.normalized());
    } else if (tag == "lookat" || tag == "skew" || tag == "instance_controller") {
      fail(fmt::format("line {} holds <{}>, which is not read", element.GetLineNum(), tag),
           "matrix, translate, rotate and scale");
    }
    return step;
  }

  template <std::size_t Count>
  std::array<double, Count> numbers(const XMLElement& element) const {
    std::array<double, Count> result{};
    std::string_view rest = content_of(element);
    for (double& value : result) {
      const std::optional<double> number = number_in(next_word(rest));
      if (!number) {
        fail(fmt::format("line {} holds a bad <{}>", element.GetLineNum(), element.Name()),
             fmt::format("{} finite numbers", Count));
      }
      value = *number;
    }
    return result;
  }

  static std::string_view content_of(const XMLElement& element) {
    const char* text = element.GetText();
    return text ? text : "";
  }

  /// `instance`: what shows it; may be null.
  void show(const XMLElement& geometry, const XMLElement* instance, const Affine3d& pose) {
    const auto [at, first_time] = shapes_.try_emplace(&geometry);
    Shape& shape = at->second;
    if (first_time) {
      shape.points = points_of(geometry);
      if (sink_.wants_triangles()) shape.surfaces = surfaces_of(geometry, shape.points.size());
    }
    const auto before = static_cast<std::uint32_t>(points_shown_);
    points_shown_ += shape.points.size();
    if (points_shown_ > kMostPoints) fail(fmt::format("its scene shows over {} points", kMostPoints), "a smaller scene");
    for (const Surface& surface : shape.surfaces) triangles_shown_ += surface.triangles.size();
    if (triangles_shown_ > kMostPoints) fail(fmt::format("its scene shows over {} triangles", kMostPoints), "a smaller scene");
    for (const Vector3d& point : shape.points) sink_.point(meter_ * (pose * point));
    const bool mirrored = pose.linear().determinant() < 0;
    for (const Surface& surface : shape.surfaces) {
      if (sink_.wants_colours()) sink_.colour(colours_.of(instance, surface.material));
      for (const auto& [a, b, c] : surface.triangles) sink_.triangle(before + a, before + (mirrored ? c : b), before + (mirrored ? b : c));
    }
  }

  using Triangles = std::vector<std::array<std::uint32_t, 3>>;

  /// Triangles of one material.
  struct Surface {
    std::string_view material;  // as the geometry calls it
    Triangles triangles;
  };

  /// A geometry in its own frame.
  struct Shape {
    std::vector<Vector3d> points;
    std::vector<Surface> surfaces;
  };

  /// Of a <mesh>, whose `points` they name; those without triangles are left out.
  std::vector<Surface> surfaces_of(const XMLElement& geometry, std::size_t points) const {
    std::vector<Surface> surfaces;
    const XMLElement* mesh = geometry.FirstChildElement("mesh");
    for (const XMLElement* at = mesh ? mesh->FirstChildElement() : nullptr; at; at = at->NextSiblingElement()) {
      const std::string_view tag = at->Name();
      if (tag != "triangles" && tag != "polylist" && tag != "polygons" && tag != "tristrips" && tag != "trifans") continue;
      Triangles triangles;
      std::string_view counts = at->FirstChildElement("vcount") ? content_of(*at->FirstChildElement("vcount")) : "";
      for (const XMLElement* p = at->FirstChildElement("p"); p; p = p->NextSiblingElement("p")) {
        std::vector<std::uint32_t> corners = corners_of(*at, *p, points);
        if (tag == "triangles") {
          cut(corners, 3, triangles);
        } else if (tag == "polylist") {
          cut(corners, counts, at->GetLineNum(), triangles);
        } else if (tag == "tristrips") {
          for (std::size_t k = 2; k < corners.size(); ++k) {
            const std::size_t odd = k % 2;
            triangles.push_back({corners[k - 2 + odd], corners[k - 1 - odd], corners[k]});
          }
        } else {
          cut(corners, corners.size(), triangles);
        }
      }
      const char* material = at->Attribute("material");
      if (!triangles.empty()) surfaces.push_back({material ? material : "", std::move(triangles)});
    }
    return surfaces;
  }

  /// Numbers of points: one of those that stand together for each corner.
  std::vector<std::uint32_t> corners_of(const XMLElement& surface, const XMLElement& list, std::size_t points) const {
    unsigned stride = 1, offset = 0;
    for (const XMLElement* input = surface.FirstChildElement("input"); input; input = input->NextSiblingElement("input")) {
      const unsigned its = std::min(input->UnsignedAttribute("offset", 0), 1000U);
      stride = std::max(stride, its + 1);
      if (input->Attribute("semantic", "VERTEX")) offset = its;
    }
    std::vector<std::uint32_t> corners;
    std::string_view rest = content_of(list);
    unsigned next = 0;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
      if (next == offset) {
        std::uint32_t number = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
        if (error != std::errc{} || end != word.data() + word.size() || number >= points) {
          fail(fmt::format("a surface of line {} names the point {}", surface.GetLineNum(), quoted(word)),
               fmt::format("one of its {} points", points));
        }
        corners.push_back(number);
      }
      next = next + 1 == stride ? 0 : next + 1;
    }
    return corners;
  }

  /// Polygons of `each` corners to triangles; what is left over at the end is none.
  static void cut(const std::vector<std::uint32_t>& corners, std::size_t each, Triangles& triangles) {
    if (each < 3) return;
    for (std::size_t first = 0; first + each <= corners.size(); first += each) {
      for (std::size_t k = first + 2; k < first + each; ++k) triangles.push_back({corners[first], corners[k - 1], corners[k]});
    }
  }

  /// Of as many corners each as `counts` says.
  void cut(const std::vector<std::uint32_t>& corners, std::string_view counts, int line, Triangles& triangles) const {
    std::size_t first = 0;
    for (std::string_view word = next_word(counts); !word.empty(); word = next_word(counts)) {
      std::size_t each = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), each);
      if (error != std::errc{} || end != word.data() + word.size() || each > corners.size() - first) {
        fail(fmt::format("a <vcount> of line {} holds {}", line, quoted(word)), "no more corners than <p> has");
      }
      for (std::size_t k = first + 2; k < first + each; ++k) triangles.push_back({corners[first], corners[k - 1], corners[k]});
      first += each;
    }
  }

  /// Positions of a <mesh>; other geometries (splines) have none.
  std::vector<Vector3d> points_of(const XMLElement& geometry) const {
    std::vector<Vector3d> points;
    const XMLElement* mesh = geometry.FirstChildElement("mesh");
    const XMLElement* vertices = mesh ? mesh->FirstChildElement("vertices") : nullptr;
    if (!vertices) return points;
    const XMLElement* input = vertices->FirstChildElement("input");
    while (input && !input->Attribute("semantic", "POSITION")) input = input->NextSiblingElement("input");
    const XMLElement* source = input ? target_of(*input, "source", "source") : nullptr;
    const XMLElement* floats = source ? source->FirstChildElement("float_array") : nullptr;
    if (!floats) {
      fail(fmt::format("the mesh of line {} has no positions", mesh->GetLineNum()), "<vertices> that name a <float_array>");
    }
    const XMLElement* technique = source->FirstChildElement("technique_common");
    const XMLElement* accessor = technique ? technique->FirstChildElement("accessor") : nullptr;
    const unsigned stride = accessor ? accessor->UnsignedAttribute("stride", 3) : 3;
    if (stride < 3) fail(fmt::format("line {} has a stride of {}", accessor->GetLineNum(), stride), "3 numbers a position");
    std::string_view rest = content_of(*floats);
    Vector3d point;
    unsigned next = 0;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
      const std::optional<double> number = number_in(word);
      if (!number) fail(fmt::format("the positions of line {} hold {}", floats->GetLineNum(), quoted(word)), "finite numbers");
      if (next < 3) point[next] = *number;
      if (next == 2) points.push_back(point);
      next = next + 1 == stride ? 0 : next + 1;
    }
    if (next != 0) {
      fail(fmt::format("the positions of line {} break off", floats->GetLineNum()), fmt::format("{} numbers each", stride));
    }
    return points;
  }

  double meters_per_unit() const {
    const XMLElement* asset = root_->FirstChildElement("asset");
    const XMLElement* unit = asset ? asset->FirstChildElement("unit") : nullptr;
    const char* meter = unit ? unit->Attribute("meter") : nullptr;
    if (!meter) return 1;
    std::string_view rest = meter;
    const std::optional<double> value = number_in(next_word(rest));
    if (!value || *value <= 0) fail(fmt::format("its unit is {} m", quoted(meter)), "a positive number");
    return *value;
  }

  const std::string& file_;
  tinyxml2::XMLDocument document_;
  const XMLElement* root_ = nullptr;
  std::unordered_map<std::string_view, const XMLElement*> called_;
  std::vector<const XMLElement*> geometries_;
  ColladaColours colours_{[this](std::string_view id) {
    const auto found = called_.find(id);
    return found == called_.end() ? nullptr : found->second;
  }};
  MeshSink& sink_;
  double meter_ = 1;
  std::unordered_map<const XMLElement*, Shape> shapes_;
  std::size_t points_shown_ = 0, triangles_shown_ = 0;
};

}  // namespace

void read_collada(const std::string& file, MeshSink& sink) { Collada(file, sink).read(); }

}  // namespace linden
