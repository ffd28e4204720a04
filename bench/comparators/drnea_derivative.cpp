#include "bench/comparators/drnea_derivative.hpp"

#include <vector>

#include "kernels/values/se3.hpp"

namespace linden::comparators {

void drnea_derivative(const Model& model, const Ancestry& ancestry, const Field<double, 12>& placement,
                      const Field<double, 7>& motion, const Field<double, 7>& displacement, Eigen::MatrixXd& J) {
  const Tree& tree = model.tree;
  const auto slots = static_cast<std::size_t>(tree.shape.slots);
  struct Body {
    Placement<double> begin, end;  // X^k, X^k+1
    Mat6<double> K;
    Twistd eta;
    Wrenchd F;  // d(h F)/dq_j
  };
  thread_local std::vector<Body> bodies;
  bodies.resize(slots);
  const auto at = [&](Index i) -> Body& { return bodies[static_cast<std::size_t>(i)]; };
  for (Index i = 1; i < tree.shape.slots; ++i) {
    Body& body = at(i);
    body.begin = load<Placement, double>(placement, i);
    body.end = after_motion(Joint<JointKind::screw>{}, body.begin, load<Displacement, double>(motion, i));
    const auto G = load<Inertia, double>(model.constants.inertia, i);
    const Twistd u = log(load<Displacement, double>(displacement, i));
    body.K = pose_derivative(G, u, G * u);
  }

  J.setZero(tree.shape.velocities, tree.shape.velocities);
  for (Index j = 1; j < tree.shape.slots; ++j) {
    const auto subtree = ancestry.subtree(j), path = ancestry.path(j);
    for (const Index i : subtree) {
      Body& body = at(i);
      body.eta = i == j ? along(model, j, 1) : to_child(body.end, at(tree.parent(i)).eta);
      body.F = body.K * body.eta;
    }
    for (std::size_t k = subtree.size(); k-- > 1;) {
      const Index i = subtree[k];
      J(i - 1, j - 1) = projected(model, i, at(i).F);
      Body& parent = at(tree.parent(i));
      parent.F = parent.F + to_parent(at(i).begin, at(i).F);
    }
    // above j nothing moves: what comes from below only passes through
    Wrenchd F = at(j).F;
    for (std::size_t k = path.size(); k-- > 0;) {
      J(path[k] - 1, j - 1) = projected(model, path[k], F);
      F = to_parent(at(path[k]).begin, F);
    }
  }
}

}  // namespace linden::comparators
