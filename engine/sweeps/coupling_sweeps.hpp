// Ties between bodies that the tree does not know of, within a step: rows, each with a gap that is to be zero and a multiplier that keeps it so.
//
//   solve    h r(delta) - G(q^k)^T lambda = 0,   g(q^k+1) = 0           for delta and lambda
//   then     p^k+1 as ever, from h r without multipliers
//   to read  v = M^-1 (p + G^T kappa) with G v = 0
//
// That is RATTLE's map: order 2, symplectic, the same there and back, and what a tree keeps of momentum it keeps. p and p + G^T kappa take the
// same step, since lambda takes up the difference; what is stored is the one without. Gaps are closed by position, so nothing drifts.
//
//   place             q^k: where bodies are, G on the paths
//   find_gaps         q^k+1 of a displacement: gaps, J on the paths
//   factor            S = J A^-1 G^T by two sweeps over the reach of each row (kernels/couplings/impulse_along_up.hpp), and its factor
//                     (masked_solve.hpp)
//   give_way          after the first half of the tree's solve, with u left of r: S dlambda = J A^-1 r - g, and u of r - G^T dlambda
//   take_multipliers  the target of the residual gets G^T dlambda, before the next evaluation
//   end               what rows that give way push at the end of the step (kernels/couplings/compliance.hpp)
//
// Multipliers are carried times h, like all impulses of a step, and begin at zero: the residual is linear in them, so what they begin with
// changes no correction, and a correction that is cut short needs none of them back. What has not been taken yet is found anew, to the bit, by
// whoever evaluates the same displacement once more: lanes that wait for others.
//
// Where joints are tied to each other (kernels/tree/mimic.hpp) A is that of the tree with tied rows held, and their coordinates are further
// unknowns, whose share of S is (J X) T^-1 Z^T (1 - A A_held^-1) G^T. What a coordinate feels of impulses, Z^T (r - A A_held^-1 r), is kHold times
// the motion of its rows; so it is a row like others.
//
// cost    a row's reach twice a factor, all reaches once an evaluation; products of rows where reaches meet
// source  Andersen 1983 (RATTLE); Featherstone, Rigid Body Dynamics Algorithms, ch. 8 (loop joints), 8.5 (loops within a tree's solve)
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/sweeps/coupling_paths.hpp"
#include "engine/sweeps/coupling_springs.hpp"
#include "kernels/block/evaluate_down.hpp"
#include "kernels/couplings/gap_map.hpp"
#include "kernels/couplings/impulse_along_up.hpp"
#include "kernels/couplings/masked_solve.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/values/lanes_of.hpp"
#include "layout/model.hpp"

namespace linden {

template <class S>
class CouplingSweeps {
 public:
  using Mask = typename LanesOf<S>::Mask;

  /// yields: of each row (coupling_yields.hpp); empty where none gives way.
  CouplingSweeps(const Model& model, std::span<const double> yields) : model_(model), paths_(model) {
    if (empty()) return;
    const Shape& shape = model.tree.shape;
    pose_.allocate(shape.slots);
    bias_.allocate(shape.slots);
    left_.allocate(shape.velocities, S(0.0));
    const std::size_t rows = paths_.rows();
    solve_ = fresh_ = MaskedSolve<S>(rows);
    for (std::vector<S>* each : {&gap_, &size_, &scale_, &lambda_, &increment_, &pull_, &moved_by_itself_}) each->assign(rows, S(0.0));
    for (std::vector<S>* each : {&begin_, &end_, &across_, &moved_}) each->assign(paths_.numbers(), S(0.0));
    for (const CouplingPath& path : paths_.all()) {
      for (const auto& term : path.coupling->terms) at_start_.push_back(as<S>(term.ratio));
      for (std::size_t row = 0; row < path.rows(); ++row) {
        const GapKind kind = rows_of(path.coupling->kind)[row].kind;
        size_[path.first_row + row] = as<S>(kind == GapKind::product || kind == GapKind::sum ? 1.0 : path.length);
        const Compliance& compliance = compliance_of(*path.coupling, rows_of(path.coupling->kind)[row]);
        if (compliance.gives_way()) springs_.add(path.first_row + row, compliance, yields.empty() ? 0 : yields[path.first_row + row]);
      }
      for (const CouplingPath::Joint& joint : path.reach) slots_.push_back(joint.slot);
    }
    const std::size_t coordinates = MimicTies<S>(model.mimics, model.tree).coordinates();
    for (std::vector<S>* each : {&tied_across_, &tied_moved_}) each->assign(rows * coordinates, S(0.0));
    felt_.resize(coordinates);
    for (Field<S>& row : felt_) row.allocate(shape.velocities, S(0.0));
    pulls_.assign(coordinates, S(0.0));
    if (gives_way()) ends_.allocate(shape.velocities, S(0.0));
  }

  bool empty() const { return paths_.empty(); }
  /// Whether some row does.
  bool gives_way() const { return !springs_.empty(); }
  bool is_rigid(std::size_t row) const { return paths_.is_rigid(row); }

  /// Bodies at q^k, where the tree's placements are; gears by their coordinates.
  void place(const Field<S, 12>& placement, const Field<S>& q) {
    if (empty()) return;
    const S zero(0.0), one(1.0);
    store(pose_, 0, Placement<S>{{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}, {zero, zero, zero}});
    for (auto slot = paths_.reached().rbegin(); slot != paths_.reached().rend(); ++slot) {
      store(pose_, *slot, placed_in(load<Placement, S>(pose_, model_.tree.parent(*slot)), load<Placement, S>(placement, *slot)));
    }
    for (std::size_t term = 0; const CouplingPath& path : paths_.all()) {
      for (const GearTerm& of : path.coupling->terms) at_start_[term++] = q(of.q_row);
    }
    look([&](Index slot) { return load<Placement, S>(pose_, slot); }, [](Index) { return S(0.0); }, begin_, !keeps_scales_);
    springs_.place(gap_);
  }
  /// Rows keep the scales of where they were placed last, so that gaps at several places can be compared.
  void keep_scales(bool keep) { keeps_scales_ = keep; }

  /// Before the first evaluation of a step of h.
  void begin(double h) {
    std::ranges::fill(lambda_, S(0.0));
    std::ranges::fill(increment_, S(0.0));
    springs_.begin(h);
  }

  /// Gaps at the end of a displacement, and how joints change them there.
  void find_gaps(const Field<S, 7>& displacement, const Field<S>& delta) {
    if (empty()) return;
    look([&](Index slot) { return moved_by(load<Placement, S>(pose_, slot), load<Displacement, S>(displacement, slot)); },
         [&](Index row) { return delta(row); }, end_, false);
  }

  /// With the gains of a tree that was just factored, and its ties. motion: with which increments are found, null for rates. damping: added
  /// to the scaled diagonal. In these lanes the factor is the one to solve with from now on.
  template <class Element>
  void factor(Coupled of, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Field<S, 7>* motion,
              const Gains<S>& gains, MimicTies<S>& ties, const Mask& lanes, double damping = 0) {
    if (empty()) return;
    const std::vector<S>& jacobian = of == Coupled::step ? end_ : begin_;
    const auto here = [&](auto, Index i) { return load<Placement, S>(placement, i); };
    const auto at_end = [&](auto joint, Index i) { return after_motion(joint, load<Placement, S>(placement, i), load_motion(joint, *motion, i)); };
    motion != nullptr ? feel(constants, at_end, gains, ties, lanes) : feel(constants, here, gains, ties, lanes);
    std::size_t first_slot = 0;
    for (const CouplingPath& path : paths_.all()) {
      const std::span<const Index> slots(&slots_[first_slot], path.reach.size());
      first_slot += slots.size();
      for (std::size_t row = path.first_row; row < path.last_row; ++row) {
        const std::size_t first = path.first_number + (row - path.first_row) * path.velocities;
        if (!ties.empty()) clear_left();
        impulse_along_up(
            model_.tree, constants, here, gains.up, slots, numbers_of(path, &begin_[first]),
            [&](auto joint, std::size_t k, const Wrench<S>&, const Wrench<S>& u) {
              const Wrench<S> moved = apply_inverse(joint, gains.inverse, model_.tree.first_block(slots[k]), u);
              store_joint(joint, left_, model_.tree.first_v(slots[k]), moved);
              put(joint, moved, &moved_[first + at(path, k)]);
            },
            bias_);
        std::ranges::copy(moved_ties(ties), tied_moved_.begin() + static_cast<std::ptrdiff_t>(row * ties.coordinates()));
        const auto keep = [&](auto joint, std::size_t k, const Wrench<S>&, const Wrench<S>& y) {
          S now[6];
          put(joint, y, now);
          S* const kept = &across_[first + at(path, k)];
          for (Index c = 0; c < velocity_count(joint); ++c) kept[c] = select(lanes, now[c], kept[c]);
        };
        const auto row_up = [&](const auto& placement_of) {
          impulse_along_up(model_.tree, constants, placement_of, gains.down, slots, numbers_of(path, &jacobian[first]), keep, bias_);
        };
        motion != nullptr ? row_up(at_end) : row_up(here);
        for (std::size_t c = 0; c < ties.coordinates(); ++c) {
          S sum(0.0);
          each_on_path(path, [&](Index v, std::size_t at_row) { sum = sum + jacobian[first + at_row] * ties.response(c)(v); });
          S& kept = tied_across_[row * ties.coordinates() + c];
          kept = select(lanes, sum, kept);
        }
      }
    }
    multiply(ties.coordinates());
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      moved_by_itself_[j] = select(lanes, fresh_.at(j, j), moved_by_itself_[j]);
      fresh_.at(j, j) = fresh_.at(j, j) + as<S>(damping);
    }
    springs_.each_yield(of, [&](std::size_t j, const S& yield) { fresh_.at(j, j) = fresh_.at(j, j) + scale_[j] * scale_[j] * yield; });
    fresh_.factor();
    solve_.take(fresh_, lanes);
  }

  /// Between the halves of a solve: innovation, u of r, becomes that of r - G^T dlambda; `with` what was passed up to each body, h F less the
  /// bias, if it is asked for. The gains are those of the factor. given: velocities that are there beside those that are solved for; null: none.
  template <class Element>
  void give_way(Coupled of, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains, MimicTies<S>& ties,
                Field<S>& innovation, Field<S, 6>* with, const Field<S>* given = nullptr) {
    if (empty()) return;
    for (const Index i : paths_.reached()) {
      with_joint(model_.tree.kind(i), [&](auto joint) {
        const Index row = model_.tree.first_v(i);
        store_joint(joint, left_, row, apply_inverse(joint, gains.inverse, model_.tree.first_block(i), load_joint(joint, innovation, row)));
      });
    }
    const std::vector<S>& tied = moved_ties(ties);
    std::vector<S>& pull = of == Coupled::step ? increment_ : pull_;
    for (const CouplingPath& path : paths_.all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) {
        S sum = of == Coupled::velocities || of == Coupled::reading ? S(0.0) : S(0.0) - gap_[row];
        const S* y = &across_[path.first_number + (row - path.first_row) * path.velocities];
        for (const CouplingPath::Joint& joint : path.reach) {
          const Index first = model_.tree.first_v(joint.slot);
          for (Index k = 0; k < velocity_count(model_.tree.kind(joint.slot)); ++k) sum = sum + *y++ * left_(first + k);
        }
        for (std::size_t c = 0; c < tied.size(); ++c) sum = sum + tied_across_[row * tied.size() + c] * tied[c];
        if (given != nullptr) {
          sum = sum + opening_of(path, row, *given);
        }
        pull[row] = sum;
      }
    }
    if (of == Coupled::step) springs_.complete(lambda_, pull);
    for (std::size_t j = 0; j < gap_.size(); ++j) pull[j] = scale_[j] * pull[j];
    solve_.solve(pull);
    for (std::size_t j = 0; j < gap_.size(); ++j) pull[j] = scale_[j] * pull[j];
    clear_left();
    push(pull, begin_, left_, minus);
    impulse_along_up(
        model_.tree, constants, [&](auto, Index i) { return load<Placement, S>(placement, i); }, gains.up, paths_.reached(),
        [&](auto joint, std::size_t k) { return load_joint(joint, left_, model_.tree.first_v(paths_.reached()[k])); },
        [&](auto joint, std::size_t k, const Wrench<S>& b, const Wrench<S>& u) {
          const Index i = paths_.reached()[k], row = model_.tree.first_v(i);
          store_joint(joint, innovation, row, load_joint(joint, innovation, row) + u);
          if (with != nullptr) store(*with, i, load<Wrench, S>(*with, i) - b);
        },
        bias_);
  }
  /// r - G^T dlambda, of the solve of a step made last.
  void subtract_push(Field<S>& residual) const {
    push(increment_, begin_, residual, minus);
  }
  /// p + G^T kappa, of the solve for velocities made last: what acts beside couplings, where p is what they have left of it.
  void add_pull(Field<S>& p) const { push(pull_, begin_, p, plus); }
  /// p - G^T kappa, likewise: all that there is of the momenta of these velocities.
  void take_pull(Field<S>& p) const { push(pull_, begin_, p, minus); }
  /// Of a step: before the evaluation that follows a solve, whatever becomes of the correction, in these lanes.
  void take_multipliers(const Mask& lanes, Field<S>& target) {
    if (empty()) return;
    push(increment_, begin_, target, [&](const S& now, const S& pushed) { return select(lanes, now + pushed, now); });
    for (std::size_t j = 0; j < gap_.size(); ++j) lambda_[j] = select(lanes, lambda_[j] + increment_[j], lambda_[j]);
  }

  /// After the last evaluation of a step of h, before bodies are placed at its end: what rows that give way push there. Returns what they took [J].
  S end(double h) {
    if (!gives_way()) return S(0.0);
    const S loss = springs_.end(h, gap_, pull_);
    std::ranges::fill(ends_.flat(), S(0.0));
    push(pull_, end_, ends_, plus);
    return loss;
  }
  /// Once momenta are those at the end of the step: in these lanes.
  void add_end(const Mask& lanes, Field<S>& p) const {
    for (Index row = 0; gives_way() && row < p.rows(); ++row) p(row) = select(lanes, p(row) + ends_(row), p(row));
  }
  /// Before velocities are read from p, at q^k, of steps of h: what gaps push at the beginning of a step beyond what they do at its end.
  void begin_reading(double h, Field<S>& p) {
    if (!gives_way()) return;
    springs_.excess(h, {}, pull_);
    push(pull_, begin_, p, plus);
  }
  /// The same of steps of h in the place of that of steps of `from`, times `times`: p of a state that goes on with another step.
  void change_step(double from, double h, double times, Field<S>& p) {
    if (!gives_way() || from == h) return;
    for (const auto& [step, sign] : {std::pair(from, 1.0), std::pair(h, -1.0)}) {
      springs_.excess(step, {}, pull_);
      for (S& pull : pull_) pull = as<S>(sign * times) * pull;
      push(pull_, begin_, p, plus);
    }
  }
  /// Momenta less all of that: those that are read as velocities v.
  void take_excess(double h, const Field<S>& v, Field<S>& p) {
    if (!gives_way()) return;
    std::vector<S> opening(gap_.size(), S(0.0));
    for (const CouplingPath& path : paths_.all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) opening[row] = opening_of(path, row, v);
    }
    springs_.excess(h, opening, pull_);
    push(pull_, begin_, p, minus);
  }
  /// Of rows that give way, at q^k [J].
  S potential() const { return springs_.potential(); }

  /// What rounding of places and of multipliers makes of the squared energy norm, in squares of epsilon.
  S rounding() const {
    using std::abs;
    S sum(0.0);
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      const S size = scale_[j] * size_[j], pushed = (lambda_[j] + increment_[j]) / scale_[j];
      sum = sum + size * size * abs(solve_.inverse(j)) + pushed * pushed * abs(moved_by_itself_[j]);
    }
    return sum;
  }

  /// Sum of the squares of all gaps of rigid rows, each over the root of how far its row would move were its bodies free.
  S openness() const {
    S sum(0.0);
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      if (is_rigid(j)) sum = sum + (scale_[j] * gap_[j]) * (scale_[j] * gap_[j]);
    }
    return sum;
  }

  /// Of the rigid row that is farthest open beside the size of its mechanism.
  S widest_gap() const {
    using std::abs, std::max;
    S widest(0.0);
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      if (is_rigid(j)) widest = max(widest, abs(gap_[j]) / size_[j]);
    }
    return widest;
  }

  std::size_t rows() const { return gap_.size(); }
  const S& gap(std::size_t row) const { return gap_[row]; }
  /// Times h^2; of the step solved last.
  S multiplier(std::size_t row) const { return springs_.whole(row, lambda_[row] + increment_[row]); }
  /// Whether a row is held by others already: its gap is watched, nothing pushes along it.
  auto is_held_already(std::size_t row) const { return is_rigid(row) && solve_.inverse(row) == S(0.0); }
  const S& pivot(std::size_t row) const { return solve_.pivot(row); }
  const S& size(std::size_t row) const { return size_[row]; }
  /// How far a unit of impulse along a row opens it, with the factor made last and other rows left out.
  S yield(std::size_t row) const { return moved_by_itself_[row] / (scale_[row] * scale_[row]); }
  const Coupling& coupling_of(std::size_t row) const {
    return *std::ranges::find_if(paths_.all(), [row](const CouplingPath& path) { return row < path.last_row; })->coupling;
  }

 private:
  static constexpr auto plus = [](const S& now, const S& pushed) { return now + pushed; };
  static constexpr auto minus = [](const S& now, const S& pushed) { return now - pushed; };

  /// G v of a row.
  S opening_of(const CouplingPath& path, std::size_t row, const Field<S>& v) const {
    const S* g = &begin_[path.first_number + (row - path.first_row) * path.velocities];
    S sum(0.0);
    each_on_path(path, [&](Index at_v, std::size_t at_row) { sum = sum + g[at_row] * v(at_v); });
    return sum;
  }

  static Placement<S> placement_of(const Pose& pose) {
    double numbers[12];
    std::ranges::copy(pose.rotation, numbers);
    std::ranges::copy(pose.shift, numbers + 9);
    return Placement<S>::from(numbers);
  }
  static std::size_t at(const CouplingPath& path, std::size_t k) { return static_cast<std::size_t>(path.reach[k].at); }

  template <JointKind Kind>
  static void put(Joint<Kind>, const Wrench<S>& value, S* numbers) {
    if constexpr (Kind == JointKind::screw) {
      numbers[0] = value.n.x;
    } else {
      value.n.to(numbers);
      if constexpr (Kind == JointKind::free) value.f.to(numbers + 3);
    }
  }
  /// A row of numbers, joint by joint; none above the path.
  static auto numbers_of(const CouplingPath& path, const S* numbers) {
    return [&path, numbers]<JointKind Kind>(Joint<Kind>, std::size_t k) {
      const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
      const std::size_t first = at(path, k);
      if (first >= path.on_path) return Wrench<S>{zero, zero};
      const S* const from = numbers + first;
      if constexpr (Kind == JointKind::screw) return Wrench<S>{{from[0], S(0.0), S(0.0)}, zero};
      if constexpr (Kind == JointKind::ball) return Wrench<S>{Vec3<S>::from(from), zero};
      return Wrench<S>{Vec3<S>::from(from), Kind == JointKind::free ? Vec3<S>::from(from + (Kind == JointKind::free ? 3 : 0)) : zero};
    };
  }

  /// What coordinates that are tied feel of impulses, as rows.
  template <class Element, class PlacementOf>
  void feel(const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Gains<S>& gains, const MimicTies<S>& ties, const Mask& lanes) {
    for (std::size_t c = 0; c < ties.coordinates(); ++c) {
      clear_left();
      ties.each_member([&](Index, Index row, double multiplier, std::size_t coordinate) {
        if (coordinate == c) left_(row) = as<S>(kHold<S> * multiplier);
      });
      const std::span<const Index> slots = paths_.reached();
      impulse_along_up(
          model_.tree, constants, placement_of, gains.down, slots,
          [&](auto joint, std::size_t k) { return load_joint(joint, left_, model_.tree.first_v(slots[k])); },
          [&](auto joint, std::size_t k, const Wrench<S>&, const Wrench<S>& y) {
            S now[6];
            put(joint, y, now);
            for (Index n = 0; n < velocity_count(joint); ++n) {
              S& kept = felt_[c](model_.tree.first_v(slots[k]) + n);
              kept = select(lanes, now[n], kept);
            }
          },
          bias_);
    }
  }
  /// How these coordinates move, after left_ = d^-1 u.
  const std::vector<S>& moved_ties(MimicTies<S>& ties) {
    for (std::size_t c = 0; c < pulls_.size(); ++c) {
      pulls_[c] = S(0.0);
      for (const Index i : paths_.reached()) {
        for (Index k = 0; k < velocity_count(model_.tree.kind(i)); ++k) {
          const Index row = model_.tree.first_v(i) + k;
          pulls_[c] = pulls_[c] + felt_[c](row) * left_(row);
        }
      }
    }
    return ties.moved_by(pulls_);
  }

  void clear_left() {
    for (const Index i : paths_.reached()) {
      for (Index k = 0; k < velocity_count(model_.tree.kind(i)); ++k) left_(model_.tree.first_v(i) + k) = S(0.0);
    }
  }

  /// S, scaled, from rows and columns.
  void multiply(std::size_t coordinates) {
    const std::span<const CouplingPath> all = paths_.all();
    for (std::size_t first = 0; first < all.size(); ++first) {
      for (std::size_t second = 0; second < all.size(); ++second) {
        const CouplingPath &of_row = all[first], &of_column = all[second];
        const std::span<const CouplingPaths::Shared> shared = paths_.shared(first, second);
        for (std::size_t j = 0; j < of_row.rows(); ++j) {
          const S* const y = &across_[of_row.first_number + j * of_row.velocities];
          for (std::size_t c = 0; c < of_column.rows(); ++c) {
            const S* const x = &moved_[of_column.first_number + c * of_column.velocities];
            S sum(0.0);
            for (const CouplingPaths::Shared& joint : shared) {
              for (Index k = 0; k < velocity_count(model_.tree.kind(joint.slot)); ++k) {
                sum = sum + y[joint.at_first + k] * x[joint.at_second + k];
              }
            }
            const std::size_t row = of_row.first_row + j, column = of_column.first_row + c;
            for (std::size_t m = 0; m < coordinates; ++m) {
              sum = sum + tied_across_[row * coordinates + m] * tied_moved_[column * coordinates + m];
            }
            fresh_.at(row, column) = scale_[row] * (scale_[column] * sum);
          }
        }
      }
    }
  }

  /// Gaps where bodies are at pose(slot) and coordinates moved by delta(row), and how joints change them; scales as well where it is asked.
  template <class PoseOf, class DeltaOf>
  void look(const PoseOf& pose, const DeltaOf& delta, std::vector<S>& numbers, bool scales) {
    std::size_t term = 0;
    for (const CouplingPath& path : paths_.all()) {
      const Coupling& coupling = *path.coupling;
      if (coupling.kind == CouplingKind::gear) {
        S& gap = gap_[path.first_row] = as<S>(coupling.offset);
        for (std::size_t k = 0; k < coupling.terms.size(); ++k, ++term) {
          gap = gap + as<S>(coupling.terms[k].ratio) * (at_start_[term] + delta(coupling.terms[k].v_row));
          numbers[path.first_number + path.terms[k]] = as<S>(coupling.terms[k].ratio);
        }
        if (scales) scale_[path.first_row] = as<S>(1 / std::sqrt(path.gear_yield));
        continue;
      }
      const Placement<S> A = placed_in(pose(coupling.slot_a), placement_of(coupling.frame_a)),
                         B = placed_in(pose(coupling.slot_b), placement_of(coupling.frame_b));
      const std::span<const GapRow> kinds = rows_of(coupling.kind);
      std::array<Gap<S>, 6> gaps;
      for (std::size_t j = 0; j < kinds.size(); ++j) {
        gaps[j] = gap_of(kinds[j], coupling.length, A, B);
        gap_[path.first_row + j] = gaps[j].gap;
      }
      for (const CouplingPath::Joint& on : path.reach) {
        if (on.sign == 0) continue;
        const Placement<S> T = pose(on.slot);
        with_joint(model_.tree.kind(on.slot), [&](auto joint) {
          for (std::size_t j = 0; j < kinds.size(); ++j) {
            gap_along(joint, model_.constants, on.slot, T, B.p, gaps[j], as<S>(on.sign),
                      &numbers[path.first_number + j * path.velocities + static_cast<std::size_t>(on.at)]);
          }
        });
      }
      for (std::size_t j = 0; scales && j < kinds.size(); ++j) scale_[path.first_row + j] = scale_of(path, gaps[j], B.p, pose);
    }
  }

  /// 1 / root of how far a row would move were its bodies free.
  template <class PoseOf>
  static S scale_of(const CouplingPath& path, const Gap<S>& gap, const Vec3<S>& x_b, const PoseOf& pose) {
    using std::sqrt;
    const auto moved = [&](Index slot, const std::array<double, 36>& yield) {
      const Placement<S> T = pose(slot);
      const Vec3<S> moment = gap.couple + cross(x_b - T.p, gap.force);
      const Twist<S> w{transpose_times(T.R, moment), transpose_times(T.R, gap.force)};
      const Wrench<S> moves = Mat6<S>::from(yield.data()) * w;  // a wrench in, a twist out: the names are those of an inertia
      return dot(moves, w);
    };
    return S(1.0) / sqrt(moved(path.coupling->slot_a, path.yield_a) + moved(path.coupling->slot_b, path.yield_b));
  }

  /// visit(velocity row, where it is among the reach's) of a path.
  template <class Visit>
  void each_on_path(const CouplingPath& path, const Visit& visit) const {
    for (const CouplingPath::Joint& joint : path.reach) {
      if (joint.sign == 0) continue;
      const Index first = model_.tree.first_v(joint.slot);
      for (Index k = 0; k < velocity_count(model_.tree.kind(joint.slot)); ++k) visit(first + k, static_cast<std::size_t>(joint.at + k));
    }
  }
  /// to = combine(to, G^T multipliers) on the paths, row by row; numbers: those of G, or J.
  template <class Combine>
  void push(const std::vector<S>& multipliers, const std::vector<S>& numbers, Field<S>& to, const Combine& combine) const {
    for (const CouplingPath& path : paths_.all()) {
      each_on_path(path, [&](Index v, std::size_t at_row) {
        S sum(0.0);
        for (std::size_t j = 0; j < path.rows(); ++j) {
          sum = sum + multipliers[path.first_row + j] * numbers[path.first_number + j * path.velocities + at_row];
        }
        to(v) = combine(to(v), sum);
      });
    }
  }

  const Model& model_;
  CouplingPaths paths_;
  std::vector<Index> slots_;     // of the reach of each
  Field<S, 12> pose_;            // body -> world at q^k, of bodies that are reached
  std::vector<S> begin_, end_;   // G at q^k, J at q^k+1: of each row what every velocity of its reach does
  std::vector<S> at_start_;      // coordinates of gears at q^k
  std::vector<S> gap_, size_, scale_, lambda_;
  std::vector<S> moved_by_itself_;  // diagonal of S, scaled
  std::vector<S> increment_;     // of lambda, by the solve made last
  std::vector<S> pull_;          // likewise, of velocities and positions
  std::vector<S> across_, tied_across_;  // of each row, what J becomes; for velocities of the reach, for coordinates that are tied
  std::vector<Field<S>> felt_;           // of each coordinate that is tied, what it feels; of the reach
  std::vector<S> pulls_;                 // by the solve there is
  std::vector<S> moved_, tied_moved_;    // of each column, how its reach yields: scratch of a factor
  MaskedSolve<S> solve_, fresh_;
  CouplingSprings<S> springs_;
  Field<S> ends_;                        // what springs push at the end of a step
  bool keeps_scales_ = false;
  Field<S, 6> bias_;             // scratch
  Field<S> left_;                // likewise; of the reach
};

}  // namespace linden
