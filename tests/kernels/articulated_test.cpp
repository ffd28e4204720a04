#include "kernels/tree/articulated.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::articulated_test {
namespace {

using Matrix6 = reference::Matrix6<double>;

/// Rows first, first + 1, ... of a field of gains, one row a degree of freedom.
MatrixXd gain_rows(const Field<double, 6>& gains, Index first, Index count) {
  MatrixXd rows(count, 6);
  for (Index k = 0; k < count; ++k) {
    for (int c = 0; c < 6; ++c) rows(k, c) = gains(first + k, c);
  }
  return rows;
}

MatrixXd inverse_block(const Field<double>& inverse, Index first, Index count) {
  MatrixXd block(count, count);
  for (Index r = 0; r < count; ++r) {
    for (Index c = 0; c < count; ++c) block(r, c) = inverse(first + r * count + c);
  }
  return block;
}

/// The sweeps' own functions work on 36 numbers in memory.
template <JointKind Kind>
Mat6<double> without_joint(Joint<Kind> joint, const Model& model, Index i, const Mat6<double>& A, const Gains<double>& gains) {
  std::array<double, 36> numbers, felt;
  A.to(numbers.data());
  eliminate_joint(joint, model.tree, model.constants, i, numbers.data(), gains, felt.data(), NothingAdded{});
  return Mat6<double>::from(felt.data());
}

Mat6<double> in_parent(const Placement<double>& X, const Placement<double>& X_pose, const Mat6<double>& A) {
  std::array<double, 36> numbers, result;
  A.to(numbers.data());
  to_parent(X, X_pose, numbers.data(), [&](int at, double value) { result[static_cast<std::size_t>(at)] = value; });
  return Mat6<double>::from(result.data());
}

TEST_CASE("a joint taken out of a 6 x 6 matrix leaves A - A S d^-1 S^T A and its gains, symmetric or not") {
  Random random(1);
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    down(model.tree, [&](auto joint, Index i) {
      const Mat6<double> A = random_matrix6(random);
      const Mat6<double> felt = without_joint(joint, model, i, A, rig.gains());
      const Matrix6 dense = eigen(A);
      const MatrixXd S = tree.body(i).S;
      const MatrixXd inverse = (S.transpose() * dense * S).inverse();
      const Index n = tree.body(i).dofs(), first = model.tree.first_v(i);
      const auto compare = [&](const MatrixXd& found, const MatrixXd& expected, double scale) {
        see(worst, (found - expected).norm() / scale);
      };
      const double condition = dense.norm() * inverse.norm();
      compare(inverse_block(rig.work.joint_inverse, model.tree.first_block(i), n), inverse, inverse.norm() * condition);
      compare(gain_rows(rig.work.gain_up, first, n).transpose(), dense * S * inverse,
              (dense * S * inverse).norm() * condition);
      compare(gain_rows(rig.work.gain_down, first, n), inverse * S.transpose() * dense,
              (inverse * S.transpose() * dense).norm() * condition);
      const Matrix6 left = dense - dense * S * inverse * S.transpose() * dense;
      compare(eigen(felt), left, dense.norm() * condition);
      // the directions that the joint frees pass nothing on
      CHECK((eigen(felt) * S).norm() <= 64 * kEpsilon * dense.norm() * condition);
      CHECK((S.transpose() * eigen(felt)).norm() <= 64 * kEpsilon * dense.norm() * condition);
    });
  }
  INFO("worst error: " << worst / kEpsilon << " epsilon times the condition number");
  CHECK(worst < 8 * kEpsilon);
}

TEST_CASE("a free joint passes on exactly nothing, a ball joint exactly no moment") {
  Random random(2);
  const Model model = random_tree({.bodies = 12, .seed = 11});
  Rig<double> rig(model);
  int balls = 0, frees = 0;
  down(model.tree, [&](auto joint, Index i) {
    const Matrix6 felt =
        eigen(without_joint(joint, model, i, random_matrix6(random), rig.gains()));
    if constexpr (joint == JointKind::free) CHECK(felt.isZero(0));
    if constexpr (joint == JointKind::ball) CHECK((felt.topRows<3>().isZero(0) && felt.leftCols<3>().isZero(0)));
    balls += joint == JointKind::ball ? 1 : 0;
    frees += joint == JointKind::free ? 1 : 0;
  });
  CHECK((balls > 0 && frees > 0));
}

TEST_CASE("a hinge with inertia 4 about its axis has the gains of a hinge") {
  LinkSpec link;
  link.name = link.joint = "wheel";
  link.axis = Eigen::Vector3d::UnitZ();
  link.inertia = box_inertia(1, Eigen::Vector3d(1, 1, 1), Eigen::Vector3d::Zero());
  const Model model = TreeBuilder("wheel").add(link).build();
  Rig<double> rig(model);
  Matrix6 A = Matrix6::Identity();
  A(2, 2) = 4;
  A(2, 0) = 2;  // row z
  A(5, 2) = 8;  // column z
  const Matrix6 felt =
      eigen(without_joint(Joint<JointKind::screw>{}, model, 1, mat6(A), rig.gains()));
  CHECK(rig.work.joint_inverse(0) == 0.25);
  CHECK((rig.work.gain_up(0, 2) == 1 && rig.work.gain_up(0, 5) == 2 && rig.work.gain_up(0, 0) == 0));
  CHECK((rig.work.gain_down(0, 2) == 1 && rig.work.gain_down(0, 0) == 0.5 && rig.work.gain_down(0, 5) == 0));
  CHECK((felt(2, 2) == 0 && felt(2, 0) == 0 && felt(5, 2) == 0 && felt(5, 0) == -4 && felt(0, 0) == 1));
}

TEST_CASE("a 6 x 6 matrix changes frames by adjoints from both sides") {
  Random random(3);
  for (int sample = 0; sample < 50; ++sample) {
    const Placement<double> X = random_placement(random), X_pose = random_placement(random);
    const Mat6<double> A = random_matrix6(random);
    const Matrix6 impulses = reference::adjoint<double>(reference::inverse<double>(eigen(X)));
    const Matrix6 poses = reference::adjoint<double>(reference::inverse<double>(eigen(X_pose)));
    CHECK(relative_error(eigen(in_parent(X, X_pose, A)), impulses.transpose() * eigen(A) * poses) < 8 * kEpsilon);
  }
}

TEST_CASE("rows and columns of a 6 x 6 matrix are found where a Mat6 keeps them") {
  Random random(4);
  const Mat6<double> A = random_matrix6(random);
  std::array<double, 36> numbers;
  A.to(numbers.data());
  const Matrix6 dense = eigen(A);
  for (int k = 0; k < 6; ++k) {
    CHECK(eigen(load_row(numbers.data() + row_start(k))) == dense.row(k).transpose());
    CHECK(eigen(load_column(numbers.data() + column_start(k))) == dense.col(k));
  }
}

TEST_CASE("eliminating joints writes every gain, allocates nothing and gives equal bits in every lane") {
  const auto kernel =
      make_kernel([](auto& rig) { factor_mass(rig); },
                  [](auto& rig) {
                    down(rig.tree, [&](auto joint, Index i) {
                      using S = std::decay_t<decltype(rig.h)>;
                      S felt[36];
                      S* const A = rig.work.articulated.row(i);
                      eliminate_joint(joint, rig.tree, rig.constants, i, A, rig.gains(), felt, NothingAdded{});
                      const auto X = load<Placement, S>(rig.work.placement, i);
                      to_parent(X, X, felt, [&](int at, const S& value) { A[at] = value; });
                    });
                  },
                  {"gain_up", "gain_down", "joint_inverse"}, {}, {"articulated"});
  check_writes(kernel);
  check_allocates_nothing(kernel);
  check_lanes(kernel);
}

}  // namespace
}  // namespace linden::articulated_test
