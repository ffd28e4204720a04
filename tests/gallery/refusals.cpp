// What no engine could simulate: refused at load, in one sentence that says what is wrong and what to do.
#include <cmath>

#include "engine/scene/scene.hpp"
#include "engine/scene/scene_file.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

LinkSpec link(const std::string& name, const std::string& parent, const LinkInertia& inertia,
              const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ(), JointType type = JointType::revolute) {
  LinkSpec spec;
  spec.name = name;
  spec.joint = name + "_joint";
  spec.parent = parent;
  spec.type = type;
  spec.axis = axis;
  spec.inertia = inertia;
  return spec;
}

const LinkInertia kBody{1, {0.1, 0, 0}, moments(0.01, 0.01, 0.01)};

struct Impossible {
  std::string what;
  std::function<void()> make;
  std::string named;  // what the message must name
};

void require_refused(Report& report, const Impossible& impossible) {
  std::string message;
  try {
    impossible.make();
  } catch (const InputError& error) {
    message = error.what();
  }
  report.at_least(impossible.what + ": refused by name",
                  !message.empty() && message.find(impossible.named) != std::string::npos ? 1 : 0, 1,
                  "no motion is a solution of it");
  report.note(message.empty() ? impossible.what + ": accepted" : message);
}

void no_inertia(Report& report) {
  const LinkInertia none;
  const auto make = [](std::vector<LinkSpec> links) {
    return [links] {
      TreeBuilder builder("impossible");
      for (const LinkSpec& one : links) builder.add(one);
      builder.build();
    };
  };
  LinkSpec point = link("point", "", {1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()});
  for (const Impossible& one : {
           Impossible{"two links without inertia", make({link("a", "", none), link("b", "a", none)}), "b_joint"},
           Impossible{"a hinge that turns nothing", make({link("a", "", kBody), link("b", "a", none)}), "b_joint"},
           Impossible{"a point of mass on its own hinge", make({point}), "point_joint"},
           Impossible{"a slide that moves no mass",
                      make({link("a", "", {0, Eigen::Vector3d::Zero(), moments(1, 1, 1)}, Eigen::Vector3d::UnitZ(),
                                 JointType::prismatic)}),
                      "a_joint"},
           Impossible{"a rod of no thickness on a ball joint",
                      make({link("a", "", {1, {0.5, 0, 0}, moments(0, 0.1, 0.1)}, Eigen::Vector3d::UnitZ(), JointType::ball)}),
                      "a_joint"},
           Impossible{"two hinges about one axis, nothing between them", make({link("a", "", none), link("b", "a", kBody)}),
                      "a_joint"},
           Impossible{"a hinge and a helix about one axis with no mass between",
                      make({link("a", "", none), link("b", "a", none, Eigen::Vector3d::UnitZ(), JointType::prismatic),
                            link("c", "b", kBody)}),
                      "a_joint"},
           Impossible{"a ball joint on a ball joint at one point",
                      make({link("a", "", none, Eigen::Vector3d::UnitZ(), JointType::ball),
                            link("b", "a", kBody, Eigen::Vector3d::UnitZ(), JointType::ball)}),
                      "a_joint"},
       }) {
    require_refused(report, one);
  }
}

void contradictions(Report& report) {
  LinkSpec backwards = link("a", "", kBody);
  backwards.limits.lower = 1;
  backwards.limits.upper = -1;
  LinkSpec free = link("a", "", kBody), leader = link("leader", "", kBody), follower = link("follower", "leader", kBody);
  leader.limits = {.lower = 0, .upper = 1};
  follower.limits = {.lower = 2, .upper = 3};
  follower.mimic = leader.joint;
  const Model tied = TreeBuilder("tied").add(leader).add(follower).build(), one = TreeBuilder("one").add(free).build();
  LinkSpec heavy = link("a", "", {-1, {0.1, 0, 0}, moments(0.01, 0.01, 0.01)});
  LinkSpec indefinite = link("a", "", {1, {0.1, 0, 0}, moments(0.01, -0.01, 0.01)});
  Effects exchanged;
  exchanged.limits = {{.row = 0, .lower = 1, .upper = -1}};
  const std::string limits = "model: chain:2\neffects: {limits: {joint1: {lower: 1, upper: -1}}}\n";
  for (const Impossible& impossible : {
           Impossible{"a lower limit above the upper", [&] { TreeBuilder("backwards").add(backwards).build(); }, "a_joint"},
           Impossible{"limits of a joint and of one that follows it without room for both", [&] { urdf_limits(tied); },
                      "leader_joint"},
           Impossible{"limits of an effect exchanged", [&] { Simulation(one, {}, exchanged); }, "limits[0]"},
           Impossible{"limits of a scene exchanged", [&] { Simulation(parse_scene(limits, "scene.yaml")); }, "scene.yaml:2"},
           Impossible{"a negative mass", [&] { TreeBuilder("negative").add(heavy).build(); }, "\"a\""},
           Impossible{"an inertia with a negative moment", [&] { TreeBuilder("indefinite").add(indefinite).build(); }, "\"a\""},
       }) {
    require_refused(report, impossible);
  }
}

}  // namespace

std::vector<Case> refusal_cases() {
  return {{"no-inertia", "joints that move nothing, alone or together", no_inertia,
           "Two hinges about one axis with nothing between them were accepted, and the first step was not finite. Articulated "
           "inertias in a generic "
           "pose find such joints at load."},
          {"contradictions", "limits that contradict each other, names and numbers that make no sense", contradictions, ""}};
}

}  // namespace linden
