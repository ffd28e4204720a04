#include "kernels/tree/placement_map.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::placement_map_test {
namespace {

const auto kernel = make_kernel(
    [](auto&) {}, [](auto& rig) { placement_map(rig.tree, rig.constants, rig.state.q, rig.work.placement); },
    {"placement"});

TEST_CASE("placement_map places every body in its parent as 4 x 4 matrices do") {
  double worst = 0;
  for_mixed_instances([&](const PlainTree& tree, const Instance& instance, Rig<double>& rig) {
    kernel.run(rig);
    for (Index i = 1; i < tree.slots(); ++i) {
      const auto expected = reference::joint_pose<double>(tree.body(i), instance.q, VectorXd::Zero(tree.velocities));
      see(worst, (row<Placement>(rig.work.placement, i) - expected).cwiseAbs().maxCoeff());
    }
  });
  INFO("worst difference: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 16 * kEpsilon);
}

TEST_CASE("a helix shifts by its pitch while it turns, a slide only shifts, a hinge only turns") {
  const auto placed = [](JointType type, double q) {
    LinkSpec link;
    link.name = link.joint = "link";
    link.type = type;
    link.axis = Eigen::Vector3d::UnitZ();
    link.pitch = 0.5;
    link.placement.translation() = Eigen::Vector3d(1, 2, 3);
    link.inertia = box_inertia(1, Eigen::Vector3d(1, 1, 1), Eigen::Vector3d::Zero());
    const Model model = TreeBuilder("one").add(link).build();
    Rig<double> rig(model);
    rig.state.q(0) = q;
    kernel.run(rig);
    // the builder may turn the frame about its own axis: what the axis and the angle do is what counts
    const auto zero =
        reference::joint_pose<double>(reference::plain_tree(model).body(1), VectorXd::Zero(1), VectorXd::Zero(1));
    return (row<Placement>(rig.work.placement, 1) * reference::inverse<double>(zero)).eval();
  };
  const double quarter = std::numbers::pi / 2;
  const Eigen::Vector4d at(2, 2, 3, 1);  // one metre from the axis
  CHECK((placed(JointType::helical, quarter) * at - Eigen::Vector4d(1, 3, 3 + quarter / 2, 1)).norm() < 8 * kEpsilon);
  CHECK((placed(JointType::prismatic, quarter) * at - Eigen::Vector4d(2, 2, 3 + quarter, 1)).norm() < 8 * kEpsilon);
  CHECK((placed(JointType::revolute, quarter) * at - Eigen::Vector4d(1, 3, 3, 1)).norm() < 8 * kEpsilon);
}

TEST_CASE("placement_map writes every placement and nothing else") { check_writes(kernel); }
TEST_CASE("placement_map allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("placement_map gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::placement_map_test
