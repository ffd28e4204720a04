#include "engine/sweeps/coupling_paths.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kernels/tree/articulated.hpp"
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
  PathMaker(const Model& model, const Coupling& coupling, bool at_world)
      : model_(model), tree_(model.tree), coupling_(coupling), at_world_(at_world) {}

  CouplingPath make() {
    path_.coupling = &coupling_;
    path_.length = norm(coupling_.frame_a.shift) + norm(coupling_.frame_b.shift);
    path_.least_yield = 0;
    find_bodies();
    mark_path();
    // where all frames are at one point, bodies are what there is to measure by
    for (const Index slot : bodies_) {
      if (slot != 0) path_.length = std::max(path_.length, size_of_body(model_, slot));
    }
    list();
    for (const Index slot : bodies_) path_.ends.push_back({number_of(slot), yield_of(model_, slot)});
    for (const GearTerm& term : coupling_.terms) add_term(term);
    if (coupling_.kind == CouplingKind::cable) path_.least_yield = kLeastYield * mean_yield();
    return std::move(path_);
  }

 private:
  /// Share of its mean yield that a row may have at least.
  static constexpr double kLeastYield = 1e-6;

  /// Those that are pushed: none of a gear.
  void find_bodies() {
    if (coupling_.kind == CouplingKind::gear) return;
    if (coupling_.kind != CouplingKind::cable) {
      bodies_ = {coupling_.slot_a, coupling_.slot_b};
      return;
    }
    for (const CablePoint& point : coupling_.points) {
      const auto found = std::ranges::find(bodies_, point.slot);
      path_.points.push_back(static_cast<std::size_t>(found - bodies_.begin()));
      if (found == bodies_.end()) bodies_.push_back(point.slot);
      path_.length += norm(point.at);
    }
  }
  /// Signs of the joints between the bodies, and where it closes; joints of terms are where their coordinates are.
  void mark_path() {
    std::vector<Index> hung = bodies_;
    for (const GearTerm& term : coupling_.terms) hung.push_back(tree_.parent(slot_of(term)));
    path_.closes_at = hung.front();
    for (const Index slot : hung) path_.closes_at = common_ancestor(path_.closes_at, slot);
    for (const Index body : bodies_) {
      const double sign = coupling_.kind != CouplingKind::cable && body == coupling_.slot_a ? -1 : 1;
      for (Index slot = body; slot != path_.closes_at && signs_.emplace(slot, sign).second; slot = tree_.parent(slot)) {
        const auto& placed = model_.constants.tree_placement;
        path_.length += std::hypot(placed(slot, 9), placed(slot, 10), placed(slot, 11));
      }
    }
    for (const GearTerm& term : coupling_.terms) signs_[slot_of(term)] = 1;
    if (at_world_) path_.closes_at = 0;
  }
  Index common_ancestor(Index a, Index b) const {
    while (a != b) {
      Index& lower = tree_.level(a) > tree_.level(b) ? a : b;
      lower = tree_.parent(lower);
    }
    return a;
  }
  Index slot_of(const GearTerm& term) const {
    Index slot = 1;
    while (tree_.first_v(slot) != term.v_row) ++slot;
    return slot;
  }
  /// A parent's slot is smaller than its child's.
  void list() {
    std::set<Index, std::greater<>> gone_through;
    for (const auto& [on_path, sign] : signs_) {
      for (Index slot = on_path; slot != path_.closes_at; slot = tree_.parent(slot)) gone_through.insert(slot);
    }
    Index at = 0;
    path_.on_path = 0;
    for (const Index slot : gone_through) {
      const auto found = signs_.find(slot);
      path_.joints.push_back({slot, at, found == signs_.end() ? 0 : found->second, -1});
      for (Index k = 0; k < velocity_count(tree_.kind(slot)); ++k, ++at) {
        path_.velocity_rows.push_back(tree_.first_v(slot) + k);
        if (found != signs_.end()) path_.moving.push_back(static_cast<std::size_t>(at));
      }
      if (found != signs_.end()) path_.on_path = static_cast<std::size_t>(at);
    }
    path_.velocities = path_.numbers = static_cast<std::size_t>(at);
    path_.slots.assign(gone_through.begin(), gone_through.end());
    for (CouplingPath::Joint& joint : path_.joints) joint.above = number_of(tree_.parent(joint.slot));
  }
  Index number_of(Index slot) const {
    const auto found = std::ranges::find(path_.joints, slot, &CouplingPath::Joint::slot);
    return found == path_.joints.end() || found->sign == 0 ? -1 : static_cast<Index>(found - path_.joints.begin());
  }
  void add_term(const GearTerm& term) {
    const Index slot = slot_of(term);
    const auto at = std::ranges::find(path_.joints, slot, &CouplingPath::Joint::slot)->at;
    path_.terms.push_back(static_cast<std::size_t>(at));
    const Eigen::Vector<double, 6> screw{0, 0, model_.constants.screw(slot, 0), 0, 0, model_.constants.screw(slot, 1)};
    path_.least_yield += term.ratio * term.ratio / screw.dot(felt_inertia(model_, slot) * screw);
  }
  /// Of a force on each of its bodies, over all directions.
  double mean_yield() const {
    double sum = 0;
    for (const CouplingPath::End& end : path_.ends) {
      for (const int k : {0, 1, 2}) sum += end.yields[static_cast<std::size_t>(row_start(3 + k) + column_start(3 + k))] / 3;
    }
    return sum;
  }

  const Model& model_;
  const Tree& tree_;
  const Coupling& coupling_;
  bool at_world_;
  CouplingPath path_{};
  std::vector<Index> bodies_;
  std::map<Index, double> signs_;
};

/// What the paths of two couplings share; next to each other in both: one piece.
std::vector<CouplingPath::Shared> shared_of(const Model& model, std::span<const Closure> closures, const CouplingPath& first, const CouplingPath& second) {
  std::vector<CouplingPath::Shared> shared;
  const auto add = [&](std::size_t at_first, std::size_t at_second, std::size_t count) {
    if (!shared.empty()) {
      CouplingPath::Shared& last = shared.back();
      if (last.at_first + last.count == at_first && last.at_second + last.count == at_second) {
        last.count += count;
        return;
      }
    }
    shared.push_back({at_first, at_second, count});
  };
  auto other = second.joints.begin();
  for (const CouplingPath::Joint& joint : first.joints) {
    while (other != second.joints.end() && other->slot > joint.slot) ++other;
    if (other == second.joints.end() || other->slot != joint.slot) continue;
    add(static_cast<std::size_t>(joint.at), static_cast<std::size_t>(other->at), static_cast<std::size_t>(velocity_count(model.tree.kind(joint.slot))));
  }
  for (const CouplingPath::Passed& one : first.passed) {
    const auto found = std::ranges::find(second.passed, one.closure, &CouplingPath::Passed::closure);
    if (found != second.passed.end()) add(one.at, found->at, closures[one.closure].rows.size());
  }
  return shared;
}

/// Couplings, by number, of which those with a joint in common are one set.
class Sets {
 public:
  explicit Sets(std::size_t count) : leader_(count) {
    for (std::size_t k = 0; k < count; ++k) leader_[k] = k;
  }
  std::size_t leader(std::size_t k) {
    while (leader_[k] != k) k = leader_[k] = leader_[leader_[k]];
    return k;
  }
  void join(std::size_t a, std::size_t b) {
    a = leader(a);
    b = leader(b);
    leader_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> leader_;
};

}  // namespace

CouplingPaths::CouplingPaths(const Model& model, Closing closing, std::size_t side_by_side, std::span<const Coupling> contacts) {
  const bool at_world = closing == Closing::at_world || !model.mimics.empty();
  for (const Coupling& coupling : model.couplings) add(model, coupling, at_world, side_by_side);
  lasting_rows_ = rows();
  for (const Coupling& contact : contacts) add(model, contact, true, side_by_side);
  std::set<Index, std::greater<>> reached;
  const auto reach = [&](Index slot) {
    for (; slot != 0 && reached.insert(slot).second; slot = model.tree.parent(slot)) {
    }
  };
  for (const CouplingPath& path : paths_) {
    for (const CouplingPath::Joint& joint : path.joints) reach(joint.slot);
  }
  if (!empty()) {
    for (const Mimic& mimic : model.mimics) {
      reach(mimic.leader_slot);
      reach(mimic.follower_slot);
    }
  }
  reached_.assign(reached.begin(), reached.end());
  close(model);
}

void CouplingPaths::add(const Model& model, const Coupling& coupling, bool at_world, std::size_t side_by_side) {
  const std::size_t row = rows();
  CouplingPath& path = paths_.emplace_back(PathMaker(model, coupling, at_world).make());
  path.first_row = row;
  path.last_row = row + rows_of(coupling).size();
  path.room = (path.rows() + side_by_side - 1) / side_by_side * side_by_side;
  path.first_velocity = velocities_;
  velocities_ += path.room * path.velocities;
  for (const GapRow& kind : rows_of(coupling)) rigid_.push_back(is_contact(coupling.kind) || compliance_of(coupling, kind).gives_way() ? 0 : 1);
}

/// Closures, and what each path passes and meets.
void CouplingPaths::close(const Model& model) {
  // those that close at one body and go through one joint close together; all, where joints that are tied to each other reach everywhere
  Sets sets(paths_.size());
  std::map<std::pair<Index, Index>, std::size_t> first_through;  // (body, joint) -> number
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    for (const CouplingPath::Joint& joint : paths_[k].joints) sets.join(k, first_through.try_emplace({paths_[k].closes_at, joint.slot}, k).first->second);
    if (!model.mimics.empty()) sets.join(k, 0);
  }
  std::vector<std::size_t> leaders;
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    if (sets.leader(k) == k) leaders.push_back(k);
  }
  std::ranges::stable_sort(leaders, std::ranges::greater(), [&](std::size_t k) { return paths_[k].closes_at; });
  std::vector<std::size_t> number_of(paths_.size());  // of the closure that a leader's set is
  for (const std::size_t leader : leaders) {
    number_of[leader] = closures_.size();
    closures_.push_back({paths_[leader].closes_at, {}, {}, 0});
  }
  std::map<Index, std::vector<std::size_t>> closures_through;  // joint -> closures with a path through it
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    const std::size_t number = number_of[sets.leader(k)];
    paths_[k].closure = number;
    paths_[k].first_in_closure = closures_[number].rows.size();
    closures_[number].paths.push_back(k);
    if (!is_contact(paths_[k].coupling->kind)) closures_[number].lasting_rows += paths_[k].rows();
    for (std::size_t row = paths_[k].first_row; row < paths_[k].last_row; ++row) closures_[number].rows.push_back(row);
    for (const CouplingPath::Joint& joint : paths_[k].joints) {
      std::vector<std::size_t>& through = closures_through[joint.slot];
      if (std::ranges::find(through, number) == through.end()) through.push_back(number);
    }
  }
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    CouplingPath& path = paths_[k];
    std::set<std::size_t> passed;
    for (const CouplingPath::Joint& joint : path.joints) {
      for (const std::size_t number : closures_through[joint.slot]) {
        if (closures_[number].slot > path.closes_at) passed.insert(number);
      }
    }
    for (const std::size_t number : passed) {
      path.passed.push_back({number, path.numbers});
      path.numbers += closures_[number].rows.size();
    }
    path.first_number = numbers_;
    numbers_ += path.room * path.numbers;
  }
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    CouplingPath& path = paths_[k];
    const auto meet = [&](const Closure& closure) {
      for (const std::size_t other : closure.paths) {
        if (is_contact(paths_[other].coupling->kind)) break;
        path.meetings.push_back({other, shared_of(model, closures_, path, paths_[other])});
      }
    };
    if (!is_contact(path.coupling->kind)) meet(closures_[path.closure]);
    path.met_in_closure = path.meetings.size();
    for (const CouplingPath::Passed& one : path.passed) meet(closures_[one.closure]);
  }
}

CouplingPaths::~CouplingPaths() = default;

const CouplingPath& CouplingPaths::path_of(std::size_t row) const { return *std::ranges::upper_bound(paths_, row, {}, &CouplingPath::last_row); }

}  // namespace linden
