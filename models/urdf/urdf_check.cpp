#include "models/urdf/urdf_check.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "layout/support/words.hpp"
#include "models/urdf/urdf_numbers.hpp"
#include "models/urdf/urdf_shapes.hpp"
#include "models/urdf/urdf_visuals.hpp"
#include "models/urdf/urdf_structure.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

/// The numbers, checked one by one as they are written down again.
class Writer {
 public:
  Writer(const UrdfStructure& robot, UrdfReport& report) : robot_(robot), report_(report) {}

  std::string run() {
    printer_.OpenElement("robot");
    put("name", robot_.name());
    for (const UrdfLink& link : robot_.links()) write_link(link);
    for (const UrdfJoint& joint : robot_.joints()) write_joint(joint);
    printer_.CloseElement();
    tell_limits_left_out();
    return printer_.CStr();
  }

 private:
  void put(const char* attribute, double value) { printer_.PushAttribute(attribute, text_of(value).c_str()); }
  void put(const char* attribute, const std::array<double, 3>& value) {
    printer_.PushAttribute(attribute,
                           fmt::format("{} {} {}", text_of(value[0]), text_of(value[1]), text_of(value[2])).c_str());
  }
  void put(const char* attribute, const std::string& value) { printer_.PushAttribute(attribute, value.c_str()); }

  void write_link(const UrdfLink& link) {
    printer_.OpenElement("link");
    put("name", link.name);
    if (const XMLElement* inertial = link.element->FirstChildElement("inertial")) {
      write_inertial("link " + quoted(link.name), *inertial);
    }
    printer_.CloseElement();
  }

  void write_origin(const std::string& owner, const XMLElement& parent) {
    const XMLElement* origin = numbers_.origin(owner, parent);
    if (!origin) return;
    printer_.OpenElement("origin");
    for (const char* part : {"xyz", "rpy"}) {
      if (origin->FindAttribute(part)) put(part, numbers_.three(owner, *origin, part));
    }
    printer_.CloseElement();
  }

  void write_inertial(const std::string& owner, const XMLElement& inertial) {
    const XMLElement* mass = inertial.FirstChildElement("mass");
    const XMLElement* inertia = inertial.FirstChildElement("inertia");
    if (!mass || !inertia) {
      report_.fail(inertial.GetLineNum(), fmt::format("{}: <inertial> has no <{}>", owner, mass ? "inertia" : "mass"),
                   mass ? "<inertia ixx=... iyy=... izz=.../> about the centre of mass" : "<mass value=\"...\"/>",
                   "add it, or delete the <inertial> of a link without mass");
    }
    const double kilograms = numbers_.one(owner, *mass, "value");
    if (kilograms < 0) {
      report_.fail(mass->GetLineNum(), fmt::format("{}: its mass is {} kg", owner, text_of(kilograms)), "zero or more",
                   "correct the mass");
    }
    printer_.OpenElement("inertial");
    write_origin(owner, inertial);
    printer_.OpenElement("mass");
    put("value", kilograms);
    printer_.CloseElement();
    printer_.OpenElement("inertia");
    for (const char* moment : {"ixx", "iyy", "izz"}) put(moment, numbers_.one(owner, *inertia, moment));
    for (const char* product : {"ixy", "ixz", "iyz"}) {
      if (!inertia->FindAttribute(product)) {
        report_.warn(inertia->GetLineNum(), fmt::format("{}: <inertia> has no {}; read as 0", owner, product));
      }
      put(product, numbers_.one_or(0, owner, *inertia, product));
    }
    printer_.CloseElement();
    printer_.CloseElement();
  }

  void write_joint(const UrdfJoint& joint) {
    const std::string owner = "joint " + quoted(joint.name);
    printer_.OpenElement("joint");
    put("name", joint.name);
    put("type", joint.type);
    write_origin(owner, *joint.element);
    write_name("parent", "link", robot_.link(joint.parent).name);
    write_name("child", "link", robot_.link(joint.child).name);
    if (joint.is_screw() || joint.type == "planar") write_axis(owner, joint);
    if (joint.is_screw()) write_limit(owner, joint);
    note_limits_left_out(joint);
    if (joint.type != "fixed") write_dynamics(owner, joint);
    if (joint.leader >= 0) {
      const XMLElement& mimic = *joint.element->FirstChildElement("mimic");
      printer_.OpenElement("mimic");
      put("joint", robot_.joint(joint.leader).name);
      put("multiplier", numbers_.one_or(1, owner, mimic, "multiplier"));
      put("offset", numbers_.one_or(0, owner, mimic, "offset"));
      printer_.CloseElement();
    }
    printer_.CloseElement();
  }

  void write_name(const char* tag, const char* attribute, const std::string& name) {
    printer_.OpenElement(tag);
    put(attribute, name);
    printer_.CloseElement();
  }

  void write_axis(const std::string& owner, const UrdfJoint& joint) {
    const XMLElement* axis = joint.element->FirstChildElement("axis");
    if (!axis) return;  // 1 0 0, says the standard, and urdfdom
    if (!axis->FindAttribute("xyz")) {
      report_.fail(axis->GetLineNum(), owner + ": <axis> has no xyz", "<axis xyz=\"...\"/>",
                   "add it, or delete the <axis> for \"1 0 0\"");
    }
    const std::array<double, 3> xyz = numbers_.three(owner, *axis, "xyz");
    // An axis this short is the rounding of a zero, not a direction.
    constexpr double kShortest = 1e-9;
    if (!(std::hypot(xyz[0], xyz[1], xyz[2]) > kShortest)) {
      report_.fail(axis->GetLineNum(), fmt::format("{}: <axis> has xyz={}", owner, quoted(axis->Attribute("xyz"))),
                   "a direction, such as \"0 0 1\"", "say about or along which axis the joint moves");
    }
    printer_.OpenElement("axis");
    put("xyz", xyz);
    printer_.CloseElement();
  }

  void write_limit(const std::string& owner, const UrdfJoint& joint) {
    const XMLElement* limit = joint.element->FirstChildElement("limit");
    double lower = -kUnlimited, upper = kUnlimited;
    std::string infinite;
    const auto read = [&](const char* name) {
      const double value = numbers_.one_or_infinity(owner, *limit, name);
      if (std::isfinite(value)) return value;
      infinite += (infinite.empty() ? "" : ", ") + std::string(name);
      return std::copysign(kUnlimited, value);
    };
    if (joint.type != "continuous") {
      const bool has_lower = limit && limit->FindAttribute("lower"), has_upper = limit && limit->FindAttribute("upper");
      const int line = (limit ? limit : joint.element)->GetLineNum();
      if (!has_lower && !has_upper) {
        report_.warn(line, fmt::format("{} is {} and has no limits; read as unlimited", owner, joint.type));
      } else {
        if (!has_lower || !has_upper) {
          report_.warn(line, fmt::format("{} has no {} limit; read as 0, as the URDF standard says", owner,
                                         has_lower ? "upper" : "lower"));
        }
        lower = has_lower ? read("lower") : 0;
        upper = has_upper ? read("upper") : 0;
        if (lower > upper) {
          report_.warn(line, fmt::format("{}: its lower limit {} is above its upper limit {}; read as unlimited", owner, shown(lower),
                                         shown(upper)));
          lower = -kUnlimited;
          upper = kUnlimited;
        }
        if (lower == upper && std::abs(lower) != kUnlimited) {
          report_.warn(line,
                       fmt::format("{}: both its limits are {}; limits, where used, lock it", owner, text_of(lower)));
        }
      }
    }
    printer_.OpenElement("limit");
    put("lower", lower);
    put("upper", upper);
    for (const char* most : {"effort", "velocity"}) {
      const double value = limit && limit->FindAttribute(most) ? read(most) : kUnlimited;
      if (value < 0 && value != -kUnlimited) {
        report_.warn(limit->GetLineNum(),
                     fmt::format("{}: its {} limit is {}; read as unlimited", owner, most, shown(value)));
      }
      put(most, value < 0 ? kUnlimited : value);
    }
    printer_.CloseElement();
    if (!infinite.empty()) {
      report_.warn(limit->GetLineNum(), fmt::format("{}: its <limit> is infinite in {}; read as unlimited", owner, infinite));
    }
  }

  static std::string shown(double limit) {
    return std::abs(limit) == kUnlimited ? (limit < 0 ? "-inf" : "inf") : text_of(limit);
  }

  /// Continuous joints have no limits of position; of floating and planar ones no limit is kept.
  void note_limits_left_out(const UrdfJoint& joint) {
    const XMLElement* limit = joint.element->FirstChildElement("limit");
    if (!limit || (joint.is_screw() && joint.type != "continuous") || joint.type == "fixed") return;
    if (joint.type == "continuous" && !limit->FindAttribute("lower") && !limit->FindAttribute("upper")) return;
    LeftOut& left_out = left_out_[joint.type];
    if (left_out.count++ == 0) left_out = {1, limit->GetLineNum(), joint.name};
  }
  void tell_limits_left_out() {
    for (const auto& [type, left_out] : left_out_) {
      const std::string others = left_out.count == 1 ? "" : fmt::format(" (and {} more)", left_out.count - 1);
      report_.warn(left_out.line, fmt::format("joint {}{} is {}: its {} not used", quoted(left_out.joint), others, type,
                                              type == "continuous" ? "lower and upper limits are" : "<limit> is"));
    }
  }

  void write_dynamics(const std::string& owner, const UrdfJoint& joint) {
    const XMLElement* dynamics = joint.element->FirstChildElement("dynamics");
    if (!dynamics) return;
    printer_.OpenElement("dynamics");
    for (const char* loss : {"damping", "friction"}) {
      const double value = numbers_.one_or(0, owner, *dynamics, loss);
      if (value < 0) {
        report_.fail(dynamics->GetLineNum(), fmt::format("{}: its {} is {}", owner, loss, text_of(value)),
                     "zero or more", "correct it: losses take energy away");
      }
      put(loss, value);
    }
    printer_.CloseElement();
  }

  struct LeftOut {
    int count = 0, line = 0;
    std::string joint;  // the first
  };

  const UrdfStructure& robot_;
  std::map<std::string, LeftOut> left_out_;  // by the joints' type
  UrdfReport& report_;
  UrdfNumbers numbers_{report_};
  tinyxml2::XMLPrinter printer_{nullptr, true};
};

}  // namespace

CheckedUrdf check_urdf(const std::string& xml, const std::string& source_name, bool mass_of_shapes) {
  UrdfReport report{source_name, {}, {}};
  const UrdfStructure robot(xml, report);
  CheckedUrdf result;
  result.xml = Writer(robot, report).run();
  UrdfVisuals visuals(robot, report);
  for (const UrdfLink& link : robot.links()) {
    if (std::vector<LinkShape> shapes = shapes_of(link, report); !shapes.empty()) result.shapes[link.name] = std::move(shapes);
    const bool give_mass = mass_of_shapes && !link.element->FirstChildElement("inertial");
    if (std::vector<LinkVisual> seen = visuals.of(link, give_mass); !seen.empty()) result.visuals[link.name] = std::move(seen);
  }
  result.visual_faults = visuals.faults();
  result.loops = loops_of(robot, report);
  for (const UrdfJoint& joint : robot.joints()) result.joints.push_back(joint.name);
  result.warnings = std::move(report.warnings);
  result.suspect = std::move(report.suspect);
  return result;
}

}  // namespace linden
