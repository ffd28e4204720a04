#include "engine/sweeps/coupling_paths.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kernels/values/joints.hpp"

namespace linden {
namespace {

using Matrix = Eigen::Matrix<double, 6, 6>;

/// Column by column, of a linear map from twists.
template <class Map>
Matrix matrix_of(const Map& map) {
  Matrix m;
  for (int c = 0; c < 6; ++c) {
    double unit[6] = {}, column[6];
    unit[c] = 1;
    map(Twist<double>::from(unit)).to(column);
    for (int r = 0; r < 6; ++r) m(r, c) = column[r];
  }
  return m;
}

Matrix inertia_of(const Model& model, Index slot) {
  const auto G = load<Inertia, double>(model.constants.inertia, slot);
  return matrix_of([&](const Twist<double>& unit) { return G * unit; });
}

bool resists_everywhere(const Matrix& inertia, double share) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(inertia);
  return eigen.eigenvalues().minCoeff() > share * eigen.eigenvalues().maxCoeff();
}

/// Of a body and all that hangs on it, in the zero configuration.
Matrix subtree_inertia(const Model& model, Index slot) {
  const Tree& tree = model.tree;
  std::vector<Matrix> whole(static_cast<std::size_t>(tree.shape.slots), Matrix::Zero());
  for (Index i = tree.shape.slots - 1; i > slot; --i) {
    Matrix& own = whole[static_cast<std::size_t>(i)];
    own += inertia_of(model, i);
    const auto X = load<Placement, double>(model.constants.tree_placement, i);
    const Matrix back = matrix_of([&](const Twist<double>& unit) { return to_child(X, unit); });  // parent's twist -> child's
    whole[static_cast<std::size_t>(tree.parent(i))] += back.transpose() * own * back;
  }
  return whole[static_cast<std::size_t>(slot)] + inertia_of(model, slot);
}

/// Of a body; of one that has none, or not in all directions, that of its subtree.
Matrix felt_inertia(const Model& model, Index slot) {
  constexpr double kNothing = 1e-12, kLittle = 1e-9;
  Matrix felt = inertia_of(model, slot);
  if (resists_everywhere(felt, kNothing)) return felt;
  felt = subtree_inertia(model, slot);
  if (!resists_everywhere(felt, kNothing)) {
    const double most = felt.diagonal().maxCoeff();
    felt += kLittle * (most > 0 ? most : 1.0) * Matrix::Identity();
  }
  return felt;
}

/// How a free body would move under a wrench, row by row of numbers as Mat6 has them. The world does not.
std::array<double, 36> yield_of(const Model& model, Index slot) {
  std::array<double, 36> numbers{};
  if (slot == 0) return numbers;
  const Matrix inverse = felt_inertia(model, slot).inverse();
  const auto block = [&](int r, int c) {
    const auto at = [&](int i, int j) { return inverse(r + i, c + j); };
    return Mat3<double>{{at(0, 0), at(0, 1), at(0, 2)}, {at(1, 0), at(1, 1), at(1, 2)}, {at(2, 0), at(2, 1), at(2, 2)}};
  };
  Mat6<double>{block(0, 0), block(0, 3), block(3, 0), block(3, 3)}.to(numbers.data());
  return numbers;
}

/// Radius of gyration of a body about its joint, of one without inertia that of all that hangs on it [m].
double size_of_body(const Model& model, Index slot) {
  const Matrix inertia = felt_inertia(model, slot);
  const double mass = inertia(3, 3);
  return mass > 0 ? std::sqrt(std::max(0.0, inertia.topLeftCorner<3, 3>().trace()) / (3 * mass)) : 0;
}

double norm(const std::array<double, 3>& a) { return std::hypot(a[0], a[1], a[2]); }

class PathMaker {
 public:
  PathMaker(const Model& model, const Coupling& coupling) : model_(model), tree_(model.tree), coupling_(coupling) {}

  CouplingPath make() {
    path_.coupling = &coupling_;
    path_.length = norm(coupling_.frame_a.shift) + norm(coupling_.frame_b.shift);
    path_.yield_a = yield_of(model_, coupling_.slot_a);
    path_.yield_b = yield_of(model_, coupling_.slot_b);
    path_.gear_yield = 0;
    mark_path();
    // where all frames are at one point, bodies are what there is to measure by
    for (const Index slot : {coupling_.slot_a, coupling_.slot_b}) {
      if (slot != 0) path_.length = std::max(path_.length, size_of_body(model_, slot));
    }
    list();
    for (const GearTerm& term : coupling_.terms) add_term(term);
    return std::move(path_);
  }

 private:
  /// Signs of the joints between the bodies; joints of a gear are where its terms are.
  void mark_path() {
    const auto pass = [&](Index& slot, double sign) {
      signs_[slot] = sign;
      const auto& placed = model_.constants.tree_placement;
      path_.length += std::hypot(placed(slot, 9), placed(slot, 10), placed(slot, 11));
      slot = tree_.parent(slot);
    };
    for (Index a = coupling_.slot_a, b = coupling_.slot_b; a != b;) tree_.level(a) > tree_.level(b) ? pass(a, -1) : pass(b, 1);
    for (const GearTerm& term : coupling_.terms) signs_[slot_of(term)] = 1;
  }
  Index slot_of(const GearTerm& term) const {
    Index slot = 1;
    while (tree_.first_v(slot) != term.v_row) ++slot;
    return slot;
  }
  /// A parent's slot is smaller than its child's.
  void list() {
    std::set<Index, std::greater<>> reach;
    for (const auto& [on_path, sign] : signs_) {
      for (Index slot = on_path; slot != 0; slot = tree_.parent(slot)) reach.insert(slot);
    }
    Index at = 0;
    path_.on_path = 0;
    for (const Index slot : reach) {
      const auto found = signs_.find(slot);
      path_.reach.push_back({slot, at, found == signs_.end() ? 0 : found->second});
      at += velocity_count(tree_.kind(slot));
      if (found != signs_.end()) path_.on_path = static_cast<std::size_t>(at);
    }
    path_.velocities = static_cast<std::size_t>(at);
  }
  void add_term(const GearTerm& term) {
    const Index slot = slot_of(term);
    const auto at = std::ranges::find(path_.reach, slot, &CouplingPath::Joint::slot)->at;
    path_.terms.push_back(static_cast<std::size_t>(at));
    const Eigen::Vector<double, 6> screw{0, 0, model_.constants.screw(slot, 0), 0, 0, model_.constants.screw(slot, 1)};
    path_.gear_yield += term.ratio * term.ratio / screw.dot(felt_inertia(model_, slot) * screw);
  }

  const Model& model_;
  const Tree& tree_;
  const Coupling& coupling_;
  CouplingPath path_{};
  std::map<Index, double> signs_;
};

std::vector<CouplingPaths::Shared> shared_of(const CouplingPath& first, const CouplingPath& second) {
  std::vector<CouplingPaths::Shared> shared;
  auto other = second.reach.begin();
  for (const CouplingPath::Joint& joint : first.reach) {
    while (other != second.reach.end() && other->slot > joint.slot) ++other;
    if (other != second.reach.end() && other->slot == joint.slot) shared.push_back({joint.slot, joint.at, other->at});
  }
  return shared;
}

}  // namespace

CouplingPaths::CouplingPaths(const Model& model) {
  std::set<Index, std::greater<>> reached;
  std::size_t row = 0;
  for (const Coupling& coupling : model.couplings) {
    CouplingPath& path = paths_.emplace_back(PathMaker(model, coupling).make());
    path.first_row = row;
    path.last_row = row += rows_of(coupling.kind).size();
    path.first_number = numbers_;
    numbers_ += path.rows() * path.velocities;
    for (const GapRow& kind : rows_of(coupling.kind)) rigid_.push_back(compliance_of(coupling, kind).gives_way() ? 0 : 1);
    for (const CouplingPath::Joint& joint : path.reach) reached.insert(joint.slot);
  }
  if (!model.couplings.empty()) {
    for (const Mimic& mimic : model.mimics) {
      for (const Index tied : {mimic.leader_slot, mimic.follower_slot}) {
        for (Index slot = tied; slot != 0; slot = model.tree.parent(slot)) reached.insert(slot);
      }
    }
  }
  reached_.assign(reached.begin(), reached.end());
  for (const CouplingPath& first : paths_) {
    for (const CouplingPath& second : paths_) shared_.push_back(shared_of(first, second));
  }
}

CouplingPaths::~CouplingPaths() = default;

}  // namespace linden
