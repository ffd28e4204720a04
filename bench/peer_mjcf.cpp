#include <fmt/format.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "bench/peer.hpp"

namespace linden {
namespace {

/// Elements within each other, above which MuJoCo's reader of XML stops.
constexpr Index kMostNested = 100;

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string numbers(std::initializer_list<double> list) {
  std::string text;
  for (const double number : list) text += fmt::format("{}{:.17g}", text.empty() ? "" : " ", number);
  return text;
}

/// Body frames are linden's: at the joint, its axis z.
std::string joint_of(const Robot& robot, Index slot) {
  const Model& model = *robot.model;
  const std::string& name = model.names.joint[static_cast<std::size_t>(slot)];
  const JointKind kind = model.tree.kind(slot);
  if (kind == JointKind::ball) return fmt::format("<joint name=\"{}\" type=\"ball\"/>", name);
  if (kind == JointKind::free) {
    if (model.tree.parent(slot) != 0) throw std::runtime_error("MuJoCo has no free joint between bodies");
    return fmt::format("<freejoint name=\"{}\"/>", name);
  }
  const double turn = model.constants.screw(slot, 0), shift = model.constants.screw(slot, 1);
  if (!(turn == 1 && shift == 0) && !(turn == 0 && shift == 1)) throw std::runtime_error("MuJoCo has no helical joint");
  double stiffness = 0, rest = 0, damping = 0;
  for (const JointSpring& spring : robot.effects.springs) {
    if (spring.row == model.tree.first_v(slot)) stiffness = spring.stiffness, rest = spring.rest;
  }
  for (const JointDamping& damper : robot.effects.damping) {
    if (damper.row == model.tree.first_v(slot)) damping = damper.coefficient;
  }
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\" axis=\"0 0 1\" stiffness=\"{:.17g}\" springref=\"{:.17g}\" damping=\"{:.17g}\"/>", name,
      turn == 1 ? "hinge" : "slide", stiffness, rest, damping);
}

std::string inertial_of(const Model& model, Index slot) {
  const double* number = model.constants.inertia.row(slot);
  const double mass = number[0];
  const Vector3d center = mass > 0 ? Vector3d(Eigen::Map<const Vector3d>(number + 1) / mass) : Vector3d::Zero();
  Matrix3d about;
  about << number[4], number[5], number[6], number[5], number[7], number[8], number[6], number[8], number[9];
  about -= mass * (center.squaredNorm() * Matrix3d::Identity() - center * center.transpose());
  return fmt::format("<inertial mass=\"{:.17g}\" pos=\"{}\" fullinertia=\"{}\"/>", mass,
                     numbers({center.x(), center.y(), center.z()}),
                     numbers({about(0, 0), about(1, 1), about(2, 2), about(0, 1), about(0, 2), about(1, 2)}));
}

std::string begin_of(const Robot& robot, Index slot) {
  const Model& model = *robot.model;
  const double* number = model.constants.tree_placement.row(slot);
  const Matrix3d rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(number);
  const Eigen::Quaterniond turn(rotation);
  return fmt::format("<body name=\"{}\" pos=\"{}\" quat=\"{}\">{}{}", model.names.body[static_cast<std::size_t>(slot)],
                     numbers({number[9], number[10], number[11]}), numbers({turn.w(), turn.x(), turn.y(), turn.z()}),
                     inertial_of(model, slot), joint_of(robot, slot));
}

}  // namespace

std::string mjcf_of(const Robot& robot) {
  const Tree& tree = robot.model->tree;
  if (tree.levels() + 3 > kMostNested) throw std::runtime_error("MuJoCo reads no file nested deeper than 100 elements");
  std::vector<std::vector<Index>> children(static_cast<std::size_t>(tree.shape.slots));
  for (Index slot = 1; slot < tree.shape.slots; ++slot) children[static_cast<std::size_t>(tree.parent(slot))].push_back(slot);
  std::string text =
      "<mujoco><compiler angle=\"radian\" inertiafromgeom=\"false\" boundmass=\"0\" boundinertia=\"0\" balanceinertia=\"false\"/>"
      "<size njmax=\"0\" nconmax=\"0\" nstack=\"1000000\"/><worldbody>";
  // without recursion: a chain is as deep as it is long; a negative slot closes its body
  std::vector<Index> waiting(children[0].rbegin(), children[0].rend());
  while (!waiting.empty()) {
    const Index slot = waiting.back();
    waiting.pop_back();
    if (slot < 0) {
      text += "</body>";
      continue;
    }
    text += begin_of(robot, slot);
    waiting.push_back(-slot);
    const auto& below = children[static_cast<std::size_t>(slot)];
    waiting.insert(waiting.end(), below.rbegin(), below.rend());
  }
  return text + "</worldbody></mujoco>\n";
}

}  // namespace linden
