#include "models/urdf/urdf_loops.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string_view>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/urdf/urdf_numbers.hpp"

namespace linden {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using tinyxml2::XMLElement;
using Words = std::initializer_list<std::string_view>;

/// So many wrong names are compared with all others: it takes long where there are many of both.
constexpr int kMostCompared = 20;

const std::array<std::pair<std::string, CouplingKind>, 11> kLoopTypes{{
    {"revolute", CouplingKind::hinge},
    {"continuous", CouplingKind::hinge},
    {"hinge", CouplingKind::hinge},
    {"prismatic", CouplingKind::slider},
    {"slider", CouplingKind::slider},
    {"spherical", CouplingKind::ball},
    {"ball", CouplingKind::ball},
    {"fixed", CouplingKind::weld},
    {"weld", CouplingKind::weld},
    {"universal", CouplingKind::universal},
    {"cylindrical", CouplingKind::cylindrical},
}};

Isometry placed_at(const std::array<double, 3>& xyz, const std::array<double, 3>& rpy) {
  Isometry pose = Isometry::Identity();
  pose.translation() = Vector3d(xyz[0], xyz[1], xyz[2]);
  // roll about x, pitch about y, yaw about z of the fixed axes, in this order
  pose.linear() = (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) * AngleAxisd(rpy[0], Vector3d::UnitX())).toRotationMatrix();
  return pose;
}

/// A word of the file, cut where it is long.
std::string bare(std::string_view word) {
  const std::string text = quoted(word);
  return text.substr(1, text.size() - 2);
}

const char* text_within(const XMLElement& element) {
  const char* text = element.GetText();
  return text ? text : "";
}

constexpr const char *kBushing = "drake:linear_bushing_rpy", *kBushingA = "drake:bushing_frameA", *kBushingC = "drake:bushing_frameC";

/// Each <frame> of a robot by its name; of several with one name the first.
std::unordered_map<std::string_view, const XMLElement*> frames_of(const XMLElement& robot) {
  std::unordered_map<std::string_view, const XMLElement*> frames;
  for (const XMLElement* frame = robot.FirstChildElement("frame"); frame; frame = frame->NextSiblingElement("frame")) {
    if (const char* name = frame->Attribute("name")) frames.try_emplace(name, frame);
  }
  return frames;
}

class LoopReader {
 public:
  LoopReader(const UrdfStructure& robot, UrdfReport& report) : robot_(robot), report_(report), frames_(frames_of(robot.robot())) {
    for (const UrdfLink& link : robot.links()) links_.insert(link.name);
  }

  std::vector<UrdfLoop> run() {
    for (const XMLElement* element = robot_.robot().FirstChildElement(); element; element = element->NextSiblingElement()) {
      const std::string_view name = element->Name();
      if (name == "loop_joint" || name == "loop") {
        take(*element, [&](UrdfLoop& loop) { read_ends(*element, loop); });
      } else if (name == "drake:ball_constraint") {
        take(*element, [&](UrdfLoop& loop) { read_ball_constraint(*element, loop); });
      } else if (name == "drake:linear_spring_damper") {
        take(*element, [&](UrdfLoop& loop) { read_spring_damper(*element, loop); });
      } else if (name == kBushing) {
        take(*element, [&](UrdfLoop& loop) { read_bushing(*element, loop); });
      } else if (name == "gazebo") {
        for (const XMLElement* joint = element->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
          take(*joint, [&](UrdfLoop& loop) { read_sdf(*joint, loop); });
        }
      }
    }
    return std::move(loops_);
  }

 private:
  /// What it is in messages.
  static std::string owner_of(const XMLElement& element) {
    const std::string tag = std::string_view(element.Name()) == "joint" ? "<joint> of <gazebo>" : fmt::format("<{}>", element.Name());
    const char* name = element.Attribute("name");
    return name && *name ? fmt::format("{} {}", tag, quoted(name)) : tag;
  }

  template <class Read>
  void take(const XMLElement& element, const Read& read) {
    UrdfLoop loop;
    loop.owner = owner_of(element);
    loop.line = element.GetLineNum();
    const char* name = element.Attribute("name");
    loop.name = name ? name : "";
    try {
      read(loop);
    } catch (const InputError& error) {
      report_.warnings.push_back(fmt::format("{}; the robot moves as if it were not there", error.what()));
      return;
    }
    give_name(loop);
    if (loop.joint) loop.joint->name = loop.name;
    loops_.push_back(std::move(loop));
  }

  void give_name(UrdfLoop& loop) {
    const auto link = [](const std::string& name) { return name.empty() ? std::string("world") : name; };
    const bool named = !loop.name.empty();
    const char* const kind = loop.kind == CouplingKind::rod ? "spring" : name_of(loop.kind);
    if (!named) loop.name = fmt::format("{} of {} and {}", kind, link(loop.link_a), link(loop.link_b));
    const std::string wanted = loop.name;
    for (int number = 2; !names_.insert(loop.name).second; ++number) loop.name = fmt::format("{}_{}", wanted, number);
    if (named && loop.name != wanted) report_.warn(loop.line, fmt::format("{}: another loop has its name; called {}", loop.owner, quoted(loop.name)));
  }

  [[noreturn]] void fail(const XMLElement& at, const UrdfLoop& loop, const std::string& found, std::string_view expected, std::string_view advice) const {
    report_.fail(at.GetLineNum(), fmt::format("{}: {}", loop.owner, found), expected, advice);
  }

  void look_at_attributes(const XMLElement& element, const UrdfLoop& loop, Words attributes) const {
    for (const auto* attribute = element.FirstAttribute(); attribute; attribute = attribute->Next()) {
      if (std::ranges::find(attributes, std::string_view(attribute->Name())) != attributes.end()) continue;
      report_.warn(attribute->GetLineNum(),
                   fmt::format("{}: <{}> has {}={}, which is not used", loop.owner, element.Name(), bare(attribute->Name()), quoted(attribute->Value())));
    }
  }

  /// Tells what of an element is not read. Only the first of each of its elements is, but for `twice`.
  void look_at(const XMLElement& element, const UrdfLoop& loop, Words attributes, Words elements, std::string_view twice = "") const {
    look_at_attributes(element, loop, attributes);
    look_at_elements(element, loop, elements, twice);
    for (const tinyxml2::XMLNode* node = element.FirstChild(); node; node = node->NextSibling()) {
      if (!node->ToText() || words_of(node->Value()).empty()) continue;
      report_.warn(node->GetLineNum(), fmt::format("{}: the text {} within <{}> is not read", loop.owner, quoted(node->Value()), element.Name()));
    }
  }
  /// The same of an element whose text is read.
  void look_beside_text(const XMLElement& element, const UrdfLoop& loop, Words attributes) const {
    look_at_attributes(element, loop, attributes);
    look_at_elements(element, loop, {}, "");
  }
  void look_at_elements(const XMLElement& element, const UrdfLoop& loop, Words elements, std::string_view twice) const {
    std::vector<std::string_view> seen;
    for (const XMLElement* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
      const std::string_view name = child->Name();
      const bool known = std::ranges::find(elements, name) != elements.end();
      const auto times = std::ranges::count(seen, name);
      if (!known && times == 0) {
        report_.warn(child->GetLineNum(), fmt::format("{}: <{}> within <{}> is not used", loop.owner, bare(name), element.Name()));
      } else if (known && times > (name == twice ? 1 : 0)) {
        report_.warn(child->GetLineNum(), fmt::format("{}: <{}> within <{}> is there again; not used", loop.owner, name, element.Name()));
      }
      if (times < 2) seen.push_back(name);
    }
  }

  const XMLElement& part(const XMLElement& of, const UrdfLoop& loop, const char* name) const {
    if (const XMLElement* found = of.FirstChildElement(name)) return *found;
    fail(of, loop, fmt::format("no <{}>", name), fmt::format("<{}> within it", name), "add it");
  }

  std::string link_of(const XMLElement& at, const UrdfLoop& loop, const char* name) const {
    const std::vector<std::string_view> words = words_of(name ? name : "");
    if (words.empty()) fail(at, loop, fmt::format("<{}> names no link", at.Name()), "a link of the file, or world", "name it");
    const std::string link(words.front().data(), words.back().data() + words.back().size());
    if (links_.contains(link)) return link;
    if (link == "world") return "";
    std::string near;
    if (++compared_ <= kMostCompared) near = nearest(link, std::vector<std::string>(links_.begin(), links_.end()));
    fail(at, loop, fmt::format("link {} does not exist", quoted(link)), fmt::format("one of the file's {} links, or world", links_.size()),
         near.empty() ? "correct the name" : fmt::format("did you mean {}?", quoted(near)));
  }

  void read_type(const XMLElement& element, UrdfLoop& loop, bool required) const {
    const char* type = element.Attribute("type");
    if (!type && !required) return;
    const auto found = std::ranges::find(kLoopTypes, std::string(type ? type : ""), &std::pair<std::string, CouplingKind>::first);
    if (found == kLoopTypes.end()) {
      fail(element, loop, type ? fmt::format("type {} is not simulated", quoted(type)) : "no type",
           "revolute, continuous, prismatic, ball, spherical, fixed, universal or cylindrical", "choose one of these");
    }
    loop.kind = found->second;
  }

  /// xyz and rpy of an element; nothing where it has neither.
  std::optional<Isometry> frame_in(const XMLElement& element, const UrdfLoop& loop) const {
    const bool shifted = element.FindAttribute("xyz"), turned = element.FindAttribute("rpy");
    if (!shifted && !turned) return std::nullopt;
    return placed_at(shifted ? numbers_.three(loop.owner, element, "xyz") : std::array<double, 3>{},
                     turned ? numbers_.three(loop.owner, element, "rpy") : std::array<double, 3>{});
  }

  struct End {
    const XMLElement* origin = nullptr;  // that says where it is; else the link's frame
    std::optional<Isometry> frame{};
  };
  /// Frame of an end in the element itself, in its <origin>, or in the one beside it.
  End end_of(const XMLElement& element, const XMLElement& holder, const char* beside, const UrdfLoop& loop) const {
    End end;
    const XMLElement* within = element.FirstChildElement("origin");
    const XMLElement* next_to = beside ? holder.FirstChildElement(beside) : nullptr;
    end.origin = within ? within : next_to ? next_to : element.FindAttribute("xyz") || element.FindAttribute("rpy") ? &element : nullptr;
    look_at(element, loop, {"link", "xyz", "rpy"}, {"origin"});
    if (within) look_at(*within, loop, {"xyz", "rpy"}, {});
    if (next_to) look_at(*next_to, loop, {"xyz", "rpy"}, {});
    if (end.origin) end.frame = frame_in(*end.origin, loop).value_or(Isometry::Identity());
    return end;
  }

  void read_ends(const XMLElement& element, UrdfLoop& loop) const {
    read_type(element, loop, false);
    const XMLElement *a = nullptr, *b = nullptr;
    const char *beside_a = nullptr, *beside_b = nullptr;
    bool meets = false;  // where no end says where it is
    if ((a = element.FirstChildElement("link1"))) {
      b = element.FirstChildElement("link2");
      look_at(element, loop, {"name", "type"}, {"link1", "link2", "axis", "limit", "dynamics"}, b ? "" : "link1");
      if (!b) b = a->NextSiblingElement("link1");
    } else if ((a = element.FirstChildElement("predecessor"))) {
      look_at(element, loop, {"name", "type"}, {"predecessor", "successor", "predecessor_origin", "successor_origin", "axis", "limit", "dynamics"});
      b = element.FirstChildElement("successor");
      beside_a = "predecessor_origin", beside_b = "successor_origin";
    } else if ((a = element.FirstChildElement("parent"))) {
      look_at(element, loop, {"name", "type"}, {"parent", "child", "parent_origin", "child_origin", "origin", "axis", "limit", "dynamics"});
      b = element.FirstChildElement("child");
      beside_a = "parent_origin", beside_b = "child_origin";
      meets = true;
    }
    if (!a || !b) {
      fail(element, loop, a ? "it names one link" : "it names no links", "<link1> and <link2>, <parent> and <child>, or <predecessor> and <successor>",
           "name both links");
    }
    loop.link_a = link_of(*a, loop, a->Attribute("link"));
    loop.link_b = link_of(*b, loop, b->Attribute("link"));
    const End end_a = end_of(*a, element, beside_a, loop), end_b = end_of(*b, element, beside_b, loop);
    const XMLElement* origin = meets ? element.FirstChildElement("origin") : nullptr;
    if (origin && (end_a.frame || end_b.frame)) fail(*origin, loop, "<origin> beside the origins of its ends", "one or the other", "delete one");
    if (meets && !(end_a.frame && end_b.frame)) {
      // one frame, or none: the other end is where it lies at zero
      loop.meeting = end_b.frame ? UrdfFrame{loop.link_b, *end_b.frame} : UrdfFrame{loop.link_a, end_a.frame.value_or(Isometry::Identity())};
      if (origin) {
        look_at(*origin, loop, {"xyz", "rpy"}, {});
        loop.meeting->pose = frame_in(*origin, loop).value_or(Isometry::Identity());
      }
    } else {
      loop.in_a = end_a.frame.value_or(Isometry::Identity());
      loop.in_b = end_b.frame.value_or(Isometry::Identity());
      loop.turned_as_at_zero = meets && !end_b.origin->FindAttribute("rpy");
    }
    const XMLElement* axis = element.FirstChildElement("axis");
    if (loop.kind == CouplingKind::universal) {
      fail(element, loop, "type universal, which has two axes", "a type with one axis", "write it as a <joint> in <gazebo>, with <axis> and <axis2>");
    }
    if (axis && has_axis(loop.kind)) read_axis(*axis, loop);
    if (axis && !has_axis(loop.kind)) report_.warn(axis->GetLineNum(), fmt::format("{}: its <axis> is not used by a {}", loop.owner, name_of(loop.kind)));
    read_joint(element, loop);
  }

  /// Limits and losses, as a <joint> has them.
  void read_joint(const XMLElement& element, UrdfLoop& loop) const {
    ClosingJoint joint;
    const XMLElement *limit = element.FirstChildElement("limit"), *dynamics = element.FirstChildElement("dynamics");
    if (limit) {
      look_at(*limit, loop, {"lower", "upper", "effort", "velocity"}, {});
      for (const auto& [name, value] : {std::pair("lower", &joint.limits.lower), std::pair("upper", &joint.limits.upper),
                                        std::pair("effort", &joint.limits.effort), std::pair("velocity", &joint.limits.velocity)}) {
        if (limit->FindAttribute(name)) *value = numbers_.one_or_infinity(loop.owner, *limit, name);
      }
    }
    if (dynamics) {
      look_at(*dynamics, loop, {"damping", "friction"}, {});
      joint.damping = numbers_.one_or(0, loop.owner, *dynamics, "damping");
      joint.friction = numbers_.one_or(0, loop.owner, *dynamics, "friction");
    }
    if (limit || dynamics) keep_joint(limit ? *limit : *dynamics, joint, loop);
  }
  void keep_joint(const XMLElement& at, const ClosingJoint& joint, UrdfLoop& loop) const {
    const bool bounded = std::isfinite(joint.limits.lower) || std::isfinite(joint.limits.upper);
    if (!bounded && joint.damping == 0 && joint.friction == 0) return;
    if (loop.kind != CouplingKind::hinge && loop.kind != CouplingKind::slider) {
      return report_.warn(at.GetLineNum(), fmt::format("{}: limits, damping and friction are not used of a {}", loop.owner, name_of(loop.kind)));
    }
    if (!(joint.damping >= 0) || !(joint.friction >= 0)) fail(at, loop, "its damping or friction is below zero", "zero or more", "correct it");
    if (joint.limits.lower > joint.limits.upper) fail(at, loop, "its lower limit is above the upper one", "the lower one first", "correct them");
    loop.joint = joint;
  }

  void read_axis(const XMLElement& axis, UrdfLoop& loop) const {
    look_at(axis, loop, {"xyz", "frame"}, {});
    const std::array<double, 3> xyz = numbers_.three(loop.owner, axis, "xyz");
    loop.axis = direction(axis, loop, {xyz[0], xyz[1], xyz[2]});
    loop.second_axis = loop.axis.unitOrthogonal();
    const char* frame = axis.Attribute("frame");
    const std::string_view in = frame ? frame : "";
    if (in == "parent" || in == "child") {
      loop.axis_in = in == "parent" ? loop.link_a : loop.link_b;
    } else if (frame && in != "joint") {
      fail(axis, loop, fmt::format("<axis> has frame={}", quoted(in)), "parent, child or joint", "choose one");
    }
  }

  Vector3d direction(const XMLElement& at, const UrdfLoop& loop, const Vector3d& axis) const {
    constexpr double kShortestAxis = 1e-9;  // the rounding of a zero
    if (!(axis.stableNorm() > kShortestAxis)) fail(at, loop, "its axis has no length", "a direction, such as 0 0 1", "say about or along which axis it moves");
    return axis.stableNormalized();
  }

  void read_ball_constraint(const XMLElement& element, UrdfLoop& loop) const {
    loop.kind = CouplingKind::ball;
    look_at(element, loop, {},
            {"drake:ball_constraint_body_A", "drake:ball_constraint_body_B", "drake:ball_constraint_p_AP", "drake:ball_constraint_p_BQ"});
    read_point(element, loop, "drake:ball_constraint_body_A", "drake:ball_constraint_p_AP", loop.link_a, loop.in_a);
    read_point(element, loop, "drake:ball_constraint_body_B", "drake:ball_constraint_p_BQ", loop.link_b, loop.in_b);
  }

  /// A link and a point in its frame, as Drake writes them.
  void read_point(const XMLElement& element, const UrdfLoop& loop, const char* body, const char* point, std::string& link, Isometry& frame) const {
    const XMLElement &names = part(element, loop, body), &says = part(element, loop, point);
    look_at(names, loop, {"name"}, {});
    look_at(says, loop, {"value"}, {});
    link = link_of(names, loop, names.Attribute("name"));
    frame = placed_at(numbers_.three(loop.owner, says, "value"), {});
  }

  void read_spring_damper(const XMLElement& element, UrdfLoop& loop) const {
    constexpr const char *kLength = "drake:linear_spring_damper_free_length", *kStiffness = "drake:linear_spring_damper_stiffness",
                         *kDamping = "drake:linear_spring_damper_damping";
    loop.kind = CouplingKind::rod;
    look_at(element, loop, {},
            {"drake:linear_spring_damper_body_A", "drake:linear_spring_damper_body_B", "drake:linear_spring_damper_p_AP", "drake:linear_spring_damper_p_BQ",
             kLength, kStiffness, kDamping});
    read_point(element, loop, "drake:linear_spring_damper_body_A", "drake:linear_spring_damper_p_AP", loop.link_a, loop.in_a);
    read_point(element, loop, "drake:linear_spring_damper_body_B", "drake:linear_spring_damper_p_BQ", loop.link_b, loop.in_b);
    const auto number = [&](const char* name) {
      const XMLElement& says = part(element, loop, name);
      look_at(says, loop, {"value"}, {});
      const double value = numbers_.one(loop.owner, says, "value");
      if (value < 0 || (value == 0 && name == kLength)) {
        fail(says, loop, fmt::format("<{}> is {}", name, value), name == kLength ? "a length above zero" : "zero or more", "correct it");
      }
      return value;
    };
    loop.length = number(kLength);
    loop.shift = {number(kStiffness), number(kDamping)};
    if (!loop.shift.gives_way()) fail(element, loop, "it neither pulls nor damps", "a stiffness or damping above zero", "give one");
  }

  void read_bushing(const XMLElement& element, UrdfLoop& loop) const {
    constexpr const char *kTurns = "drake:bushing_torque_stiffness", *kTurnsSlowly = "drake:bushing_torque_damping",
                         *kShifts = "drake:bushing_force_stiffness", *kShiftsSlowly = "drake:bushing_force_damping";
    loop.kind = CouplingKind::bushing;
    look_at(element, loop, {}, {kBushingA, kBushingC, kTurns, kTurnsSlowly, kShifts, kShiftsSlowly});
    read_frame(part(element, loop, kBushingA), loop, loop.link_a, loop.in_a);
    read_frame(part(element, loop, kBushingC), loop, loop.link_b, loop.in_b);
    const auto numbers = [&](const char* name) {
      const XMLElement* const says = element.FirstChildElement(name);
      if (!says) return std::array<double, 3>{};
      look_at(*says, loop, {"value"}, {});
      const std::array<double, 3> three = numbers_.three(loop.owner, *says, "value");
      if (std::ranges::min(three) < 0) fail(*says, loop, fmt::format("<{}> has a number below zero", name), "three numbers, zero or more", "correct it");
      return three;
    };
    loop.turn = {numbers(kTurns), numbers(kTurnsSlowly)};
    loop.shift = {numbers(kShifts), numbers(kShiftsSlowly)};
    if (!loop.shift.gives_way() && !loop.turn.gives_way()) {
      fail(element, loop, "it neither pulls nor damps", "a stiffness or damping above zero", "give one");
    }
  }
  /// A <frame> of the robot, or a link, that an element of Drake names.
  void read_frame(const XMLElement& names, const UrdfLoop& loop, std::string& link, Isometry& pose) const {
    look_at(names, loop, {"name"}, {});
    const char* const name = names.Attribute("name");
    const auto found = frames_.find(name ? name : "");
    if (found == frames_.end()) {
      link = link_of(names, loop, name);
      return;
    }
    const XMLElement& frame = *found->second;
    look_at(frame, loop, {"name", "link", "xyz", "rpy"}, {});
    link = link_of(frame, loop, frame.Attribute("link"));
    pose = frame_in(frame, loop).value_or(Isometry::Identity());
  }

  /// The numbers that an element of SDFormat holds as its text.
  std::vector<double> numbers_within(const XMLElement& element, const UrdfLoop& loop, std::size_t count) const {
    std::vector<double> numbers;
    const std::vector<std::string_view> words = words_of(text_within(element));
    for (const std::string_view word : words) {
      if (const std::optional<double> number = number_in(word)) numbers.push_back(*number);
    }
    if (numbers.size() != count || words.size() != count) {
      fail(element, loop, fmt::format("<{}> holds {}", element.Name(), quoted(text_within(element))), fmt::format("{} finite numbers", count), "correct it");
    }
    return numbers;
  }

  /// A frame that SDFormat names: a link, or the model's own.
  std::string sdf_frame(const XMLElement& element, const UrdfLoop& loop, const char* name) const {
    return std::string_view(name) == "__model__" ? "" : link_of(element, loop, name);
  }

  void read_sdf(const XMLElement& element, UrdfLoop& loop) const {
    read_type(element, loop, true);
    look_at(element, loop, {"name", "type"}, {"parent", "child", "pose", "axis", "axis2"});
    const auto link = [&](const char* end) {
      const XMLElement& names = part(element, loop, end);
      look_beside_text(names, loop, {"link"});
      const char* attribute = names.Attribute("link");
      return link_of(names, loop, attribute ? attribute : text_within(names));
    };
    loop.link_a = link("parent");
    loop.link_b = link("child");
    loop.meeting = UrdfFrame{loop.link_b};
    if (const XMLElement* pose = element.FirstChildElement("pose")) read_pose(*pose, loop);
    if (!has_axis(loop.kind)) {
      if (const XMLElement* axis = element.FirstChildElement("axis")) {
        report_.warn(axis->GetLineNum(), fmt::format("{}: its <axis> is not used by a {}", loop.owner, name_of(loop.kind)));
      }
      return;
    }
    const std::optional<std::string> first = read_sdf_axis(part(element, loop, "axis"), loop, loop.axis);
    read_sdf_joint(part(element, loop, "axis"), loop);
    loop.axis_in = first;
    loop.second_axis = loop.axis.unitOrthogonal();
    if (loop.kind != CouplingKind::universal) return;
    const XMLElement& axis2 = part(element, loop, "axis2");
    if (read_sdf_axis(axis2, loop, loop.second_axis) != first) fail(axis2, loop, "its axes are given in two frames", "one for both", "turn one of them");
    if (std::abs(loop.axis.dot(loop.second_axis)) > 1e-6) {
      fail(axis2, loop, "its two axes are not at right angles", "axes at right angles", "correct one");
    }
  }

  void read_pose(const XMLElement& pose, UrdfLoop& loop) const {
    look_beside_text(pose, loop, {"relative_to", "frame", "degrees"});
    const std::vector<double> numbers = numbers_within(pose, loop, 6);
    const double unit = pose.BoolAttribute("degrees") ? std::numbers::pi / 180 : 1;
    loop.meeting->pose = placed_at({numbers[0], numbers[1], numbers[2]}, {unit * numbers[3], unit * numbers[4], unit * numbers[5]});
    const char* frame = pose.Attribute("relative_to") ? pose.Attribute("relative_to") : pose.Attribute("frame");
    if (frame && *frame) loop.meeting->link = sdf_frame(pose, loop, frame);
  }

  /// A number of SDFormat within an element; limits of 1e16 and more are none.
  double number_within(const XMLElement& element, const UrdfLoop& loop, const char* name, double otherwise) const {
    constexpr double kNoLimit = 1e16;
    const XMLElement* const says = element.FirstChildElement(name);
    if (!says) return otherwise;
    look_beside_text(*says, loop, {});
    const std::vector<std::string_view> words = words_of(text_within(*says));
    if (words.size() == 1 && (words[0].ends_with("inf") || words[0].ends_with("infinity"))) return words[0].starts_with('-') ? -INFINITY : INFINITY;
    const double number = numbers_within(*says, loop, 1)[0];
    return std::abs(number) >= kNoLimit ? std::copysign(INFINITY, number) : number;
  }
  /// Of SDFormat's <limit> and <dynamics> within an <axis>; a spring is told.
  void read_sdf_joint(const XMLElement& axis, UrdfLoop& loop) const {
    ClosingJoint joint;
    const XMLElement *limit = axis.FirstChildElement("limit"), *dynamics = axis.FirstChildElement("dynamics");
    if (limit) {
      look_at(*limit, loop, {}, {"lower", "upper", "effort", "velocity"});
      joint.limits.lower = number_within(*limit, loop, "lower", joint.limits.lower);
      joint.limits.upper = number_within(*limit, loop, "upper", joint.limits.upper);
      // what is below zero is no limit
      for (const auto& [name, value] : {std::pair("effort", &joint.limits.effort), std::pair("velocity", &joint.limits.velocity)}) {
        const double most = number_within(*limit, loop, name, *value);
        if (most >= 0) *value = most;
      }
    }
    if (dynamics) {
      look_at(*dynamics, loop, {}, {"damping", "friction", "spring_reference", "spring_stiffness"});
      joint.damping = number_within(*dynamics, loop, "damping", 0);
      joint.friction = number_within(*dynamics, loop, "friction", 0);
      if (number_within(*dynamics, loop, "spring_stiffness", 0) != 0) {
        report_.warn(dynamics->GetLineNum(), fmt::format("{}: <spring_stiffness> within <dynamics> is not used", loop.owner));
      }
    }
    if (limit || dynamics) keep_joint(limit ? *limit : *dynamics, joint, loop);
  }

  /// Returns the frame that the axis is given in, as UrdfLoop::axis_in has it.
  std::optional<std::string> read_sdf_axis(const XMLElement& element, const UrdfLoop& loop, Vector3d& axis) const {
    look_at(element, loop, {}, {"xyz", "use_parent_model_frame", "limit", "dynamics"});
    const XMLElement& xyz = part(element, loop, "xyz");
    look_beside_text(xyz, loop, {"expressed_in"});
    const std::vector<double> numbers = numbers_within(xyz, loop, 3);
    axis = direction(xyz, loop, {numbers[0], numbers[1], numbers[2]});
    const XMLElement* model = element.FirstChildElement("use_parent_model_frame");
    if (model) look_beside_text(*model, loop, {});
    const std::vector<std::string_view> said = words_of(model ? text_within(*model) : "0");
    const bool in_model = said.size() == 1 && (said[0] == "1" || said[0] == "true");
    if (!in_model && !(said.size() == 1 && (said[0] == "0" || said[0] == "false"))) {
      fail(*model, loop, fmt::format("<{}> holds {}", model->Name(), quoted(text_within(*model))), "true or false", "correct it");
    }
    if (in_model) return "";
    const char* frame = xyz.Attribute("expressed_in");
    return frame && *frame ? std::optional(sdf_frame(xyz, loop, frame)) : std::nullopt;
  }

  const UrdfStructure& robot_;
  UrdfReport& report_;
  UrdfNumbers numbers_{report_};
  std::unordered_map<std::string_view, const XMLElement*> frames_;
  std::set<std::string> links_;
  mutable int compared_ = 0;  // wrong links with all that there are
  std::unordered_set<std::string> names_;
  std::vector<UrdfLoop> loops_;
};

}  // namespace

std::vector<UrdfLoop> loops_of(const UrdfStructure& robot, UrdfReport& report) { return LoopReader(robot, report).run(); }

std::unordered_set<const XMLElement*> frames_of_bushings(const XMLElement& robot) {
  const std::unordered_map<std::string_view, const XMLElement*> frames = frames_of(robot);
  std::unordered_set<const XMLElement*> held;
  for (const XMLElement* bushing = robot.FirstChildElement(kBushing); bushing; bushing = bushing->NextSiblingElement(kBushing)) {
    for (const char* const end : {kBushingA, kBushingC}) {
      const XMLElement* const names = bushing->FirstChildElement(end);
      const char* const name = names ? names->Attribute("name") : nullptr;
      if (const auto found = frames.find(name ? name : ""); found != frames.end()) held.insert(found->second);
    }
  }
  return held;
}

bool holds_joints_only(const XMLElement& gazebo) {
  if (std::string_view(gazebo.Name()) != "gazebo" || !gazebo.FirstChildElement("joint")) return false;
  for (const XMLElement* child = gazebo.FirstChildElement(); child; child = child->NextSiblingElement()) {
    if (std::string_view(child->Name()) != "joint") return false;
  }
  return true;
}

}  // namespace linden
