#include "layout/collada.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <array>
#include <numbers>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "layout/input_error.hpp"
#include "layout/text_file.hpp"
#include "layout/words.hpp"
#include "layout/xml_text.hpp"

namespace linden {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;
using tinyxml2::XMLElement;

/// More than any robot's part has, few enough to be walked in a fraction of a second.
constexpr std::size_t kMostElements = 200'000, kMostPoints = 20'000'000;

class Collada {
 public:
  explicit Collada(const std::string& file) : file_(file) {
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

  MeshBox box() {
    if (const XMLElement* scene = shown_scene()) {
      walk(*scene);
    } else {
      for (const XMLElement* geometry : geometries_) show(*geometry, Affine3d::Identity());
    }
    const double meter = meters_per_unit();
    return box_.isEmpty() ? box_ : MeshBox(meter * box_.min(), meter * box_.max());
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
          show(*shown, pose);
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

  void show(const XMLElement& geometry, const Affine3d& pose) {
    const auto [at, first_time] = points_.try_emplace(&geometry);
    if (first_time) at->second = points_of(geometry);
    points_shown_ += at->second.size();
    if (points_shown_ > kMostPoints) fail(fmt::format("its scene shows over {} points", kMostPoints), "a smaller scene");
    for (const Vector3d& point : at->second) box_.extend(pose * point);
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
  std::unordered_map<const XMLElement*, std::vector<Vector3d>> points_;
  std::size_t points_shown_ = 0;
  MeshBox box_;
};

}  // namespace

MeshBox collada_box(const std::string& file) { return Collada(file).box(); }

}  // namespace linden
