// Ties between bodies that the tree does not know of, within a step: rows, each with a gap that is to be zero and a multiplier that keeps it so.
//
//   solve    h r(delta) - G(q^k)^T lambda = 0,   g(q^k+1) = 0           for delta and lambda
//   then     p^k+1 as ever, from h r without multipliers
//   to read  v = M^-1 (p + G^T kappa) with G v = 0
//
// That is RATTLE's map: order 2, symplectic, the same there and back, and what a tree keeps of momentum it keeps. p and p + G^T kappa take the
// same step, since lambda takes up the difference; what is stored is the one without. Gaps are closed by position, so nothing drifts.
//
// Rows are unknowns of the tree's own elimination: once the joints of a loop have been taken out, its rows are, and what is left for the body
// where it closes is inertia. With A of the joints below that body, eta how that body moves, b and y what columns of G^T and rows of J have
// become there (kernels/couplings/impulse_along_up.hpp):
//
//   S = J A^-1 G^T,   S dlambda = J A^-1 r - g - y^T eta,   A_body += b S^-1 y^T                    (masked_solve.hpp)
//
//   factor   the tree's sweep between bodies where couplings close (up_to_closures), and close() there
//   solve    up: the tree's sweep, and yield(): rho = S^-1 (J A^-1 r - g), the body gets b rho less
//            down: push(): dlambda = rho - S^-1 y^T eta, joints below get u of r - G^T dlambda, then the tree's sweep to the next (down_from_closures)
//
// A loop costs what its path does, wherever it hangs: a ladder of a thousand cells, each closing at the one above, is solved in O(n). What closes
// at the world is solved by one dense matrix, over the paths.
//
// Multipliers are carried times h, like all impulses of a step, and begin at zero: the residual is linear in them, so what they begin with
// changes no correction, and a correction that is cut short needs none of them back. What has not been taken yet is found anew, to the bit, by
// whoever evaluates the same displacement once more: lanes that wait for others.
//
// Where joints are tied to each other (kernels/tree/mimic.hpp) A is that of the tree with tied rows held, and their coordinates are further
// unknowns, whose share of S is (J X) T^-1 Z^T (1 - A A_held^-1) G^T. What a coordinate feels of impulses, Z^T (r - A A_held^-1 r), is kHold times
// the motion of its rows; so it is a row like others.
//
// cost    a factor: two sweeps over the path of each row, products of rows where paths meet; a solve: numbers of all paths, twice
// source  Andersen 1983 (RATTLE); Featherstone, Rigid Body Dynamics Algorithms, ch. 8 (loop joints), 8.5 (loops within a tree's solve)
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/sweeps/coupling_rows.hpp"
#include "engine/sweeps/coupling_springs.hpp"
#include "kernels/block/evaluate_down.hpp"
#include "kernels/couplings/impulse_along_up.hpp"
#include "kernels/couplings/masked_solve.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/values/lanes_of.hpp"
#include "layout/model.hpp"

namespace linden {

/// Pack: what rows of a coupling are side by side in (row_lanes.hpp).
template <class S, class Pack = RowPack<S>>
class CouplingSweeps {
 public:
  using Mask = typename LanesOf<S>::Mask;
  using Side = RowLanes<S, Pack>;

  /// yields: of each row (coupling_yields.hpp); empty where none gives way.
  CouplingSweeps(const Model& model, std::span<const double> yields, Closing closing = Closing::nearest) : model_(model), rows_(model, closing) {
    if (empty()) return;
    const Shape& shape = model.tree.shape;
    bias_.allocate(shape.slots);
    std::size_t most = 0;
    for (const Closure& closure : closures()) most = std::max(most, closure.rows.size());
    right_sides_.resize(most, Pack(0.0));
    for (std::vector<S>* each : {&lambda_, &increment_, &pull_, &rho_}) each->assign(rows(), S(0.0));
    for (std::vector<S>* each : {&across_, &columns_}) each->assign(paths().numbers(), S(0.0));
    for (const Closure& closure : closures()) factors_.emplace_back(closure.rows.size());
    for (const CouplingPath& path : paths().all()) {
      for (std::size_t row = 0; row < path.rows(); ++row) {
        const Compliance& compliance = compliance_of(*path.coupling, rows_of(path.coupling->kind)[row]);
        if (compliance.gives_way()) springs_.add(path.first_row + row, compliance, yields.empty() ? 0 : yields[path.first_row + row]);
      }
    }
    const std::size_t coordinates = MimicTies<S>(model.mimics, model.tree).coordinates();
    for (std::vector<S>* each : {&tied_across_, &tied_columns_}) each->assign(rows() * coordinates, S(0.0));
    felt_.resize(coordinates);
    for (Field<S>& row : felt_) row.allocate(shape.velocities);
    pulls_.assign(coordinates, S(0.0));
    if (coordinates > 0) tied_.allocate(shape.velocities, S(0.0));
    if (coordinates > 0) tied_bias_.allocate(shape.slots);
    if (gives_way()) ends_.allocate(shape.velocities, S(0.0));
  }

  bool empty() const { return rows_.empty(); }
  /// Whether some row does.
  bool gives_way() const { return !springs_.empty(); }

  /// At q^k, where the tree's placements are.
  void place(const Field<S, 12>& placement, const Field<S>& q) {
    if (empty()) return;
    rows_.place(placement, q);
    springs_.place(rows_.gaps());
  }
  void keep_scales(bool keep) { rows_.keep_scales(keep); }
  /// Before the first evaluation of a step of h.
  void begin(double h) {
    std::ranges::fill(lambda_, S(0.0));
    std::ranges::fill(increment_, S(0.0));
    springs_.begin(h);
  }
  /// Gaps at the end of motions of the joints, and how joints change them there.
  void find_gaps(const Field<S, 12>& placement, const Field<S, 7>& motion, const Field<S>& delta) {
    if (!empty()) rows_.find_gaps(placement, motion, delta);
  }

  /// sweep(slots) of all bodies, leaves to root, in parts: at(closure) once all bodies beyond that where it closes have been met, and it has
  /// not.
  template <class Sweep, class At>
  void up_to_closures(const Sweep& sweep, const At& at) const {
    Slots left = all_slots(model_.tree);
    for (std::size_t k = 0; k < closures().size(); ++k) {
      const Index beyond = closures()[k].slot + 1;
      if (beyond < left.end) sweep(left.part(beyond, left.end));
      left.end = std::min(left.end, beyond);
      at(k);
    }
    if (left.begin < left.end) sweep(left);
  }
  /// The same, root to leaves: at(closure) once the body where it closes has been met, and none beyond has.
  template <class Sweep, class At>
  void down_from_closures(const Sweep& sweep, const At& at) const {
    Slots left = all_slots(model_.tree);
    for (std::size_t k = closures().size(); k-- > 0;) {
      const Index beyond = closures()[k].slot + 1;
      if (left.begin < beyond) sweep(left.part(left.begin, beyond));
      left.begin = std::max(left.begin, beyond);
      at(k);
    }
    if (left.begin < left.end) sweep(left);
  }
  /// Body where it closes, 0: the world.
  Index slot_of(std::size_t closure) const { return closures()[closure].slot; }

  /// Within up_to_closures of a factor, whose gains and ties are those of the bodies beyond. motion: with which increments are found, null for
  /// rates. damping: added to the scaled diagonal. In these lanes the factor is the one to solve with from now on. Returns what the body
  /// where it closes feels of it, as Mat6 has it; for the world there is nothing.
  template <class Element>
  std::array<S, 36> close(std::size_t closure, Coupled of, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                          const Field<S, 7>* motion, const Gains<S>& gains, MimicTies<S>& ties, const Mask& lanes, double damping = 0) {
    const auto here = [&](auto, Index i) { return load<Placement, S>(placement, i); };
    const auto at_end = [&](auto joint, Index i) { return after_motion(joint, load<Placement, S>(placement, i), load_motion(joint, *motion, i)); };
    const std::vector<S>& jacobian = of == Coupled::step ? rows_.at_end() : rows_.at_begin();
    const auto paths_up = [&](const auto& arrives) {
      if (closure == 0) feel(constants, arrives, gains, ties, lanes);
      for (const std::size_t k : closures()[closure].paths) {
        const CouplingPath& path = paths().all()[k];
        for (std::size_t first = 0; first < path.rows(); first += Side::count) column_up(path, first, constants, here, gains, lanes);
        for (std::size_t first = 0; first < path.rows(); first += Side::count) row_up(path, first, jacobian, constants, arrives, gains, lanes);
        move_ties(path, ties);
        cross_ties(path, jacobian, ties, lanes);
      }
    };
    motion != nullptr ? paths_up(at_end) : paths_up(here);
    factor(closure, of, ties.coordinates(), lanes, damping);
    return felt_above(closure);
  }

  /// Before the first half of a solve. given: velocities that are there beside those that are solved for; null: none.
  void begin_solve(Coupled of, const Field<S>* given = nullptr) {
    if (empty()) return;
    for (const CouplingPath& path : paths().all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) {
        rho_[row] = of == Coupled::velocities || of == Coupled::reading ? S(0.0) : S(0.0) - rows_.gaps()[row];
        if (given != nullptr) rho_[row] = rho_[row] + rows_.opening_of(path, row, *given);
      }
    }
    if (of == Coupled::step) springs_.complete(lambda_, rho_);
  }
  /// Within up_to_closures of the first half of a solve, whose innovation, u of r, is that of the bodies beyond: of the bias, what was passed up
  /// to bodies, that of the body where it closes.
  void yield(std::size_t closure, MimicTies<S>& ties, const Field<S>& innovation, Field<S, 6>& bias) {
    const Closure& closes = closures()[closure];
    ClosureFactor& kept = factors_[closure];
    if (closure == 0) moved_ties(ties, paths().reached(), [&](Index v, std::size_t) { return innovation(v); });
    for (const std::size_t k : closes.paths) {
      const CouplingPath& path = paths().all()[k];
      for (std::size_t first = 0; first < path.rows(); first += Side::count) {
        const S* const numbers = &across_[path.first_number + first];
        Pack sum(0.0);
        each_velocity(path, [&](Index v, std::size_t n) { sum = sum + Side::load(numbers + n * path.room) * Pack(innovation(v)); });
        for (const CouplingPath::Passed& passed : path.passed) {
          const std::vector<std::size_t>& rows = closures()[passed.closure].rows;
          for (std::size_t i = 0; i < rows.size(); ++i) sum = sum + Side::load(numbers + (passed.at + i) * path.room) * Pack(rho_[rows[i]]);
        }
        each_row_of(path, first, sum, [&](std::size_t j, const S& along) {
          const std::size_t row = path.first_row + j;
          S& right_side = kept.right_side[path.first_in_closure + j] = rho_[row] + along;
          for (std::size_t c = 0; c < pulls_.size(); ++c) right_side = right_side + tied_across_[row * pulls_.size() + c] * (*tied_moved_)[c];
        });
      }
    }
    solve(closure, kept.right_side.data());
    for (std::size_t k = 0; k < closes.rows.size(); ++k) rho_[closes.rows[k]] = kept.right_side[k];
    if (closes.slot == 0) return;
    for (int c = 0; c < 6; ++c) {
      S sum(0.0);
      for (std::size_t k = 0; k < closes.rows.size(); ++k) sum = sum + kept.up[kSix * k + static_cast<std::size_t>(c)] * kept.right_side[k];
      bias(closes.slot, c) = bias(closes.slot, c) - sum;
    }
  }
  /// Within down_from_closures of the second half of a solve, where it is known how the body where it closes moves: the innovation of joints
  /// beyond becomes that of r - G^T dlambda.
  void push(std::size_t closure, Coupled of, const Field<S, 6>& variation, Field<S>& innovation) {
    const Closure& closes = closures()[closure];
    const ClosureFactor& kept = factors_[closure];
    std::vector<S>& multipliers = of == Coupled::step ? increment_ : pull_;
    for (const std::size_t k : closes.paths) {
      const CouplingPath& path = paths().all()[k];
      const S* const of_path = &multipliers[path.first_row];
      for (std::size_t j = 0; j < path.rows(); ++j) {
        S& multiplier = multipliers[path.first_row + j] = rho_[path.first_row + j];
        const S* const down = &kept.down[kSix * (path.first_in_closure + j)];
        for (int c = 0; closes.slot != 0 && c < 6; ++c) multiplier = multiplier - down[c] * variation(closes.slot, c);
      }
      const auto pushed = [&](std::size_t n) {
        S sum(0.0);
        for (std::size_t j = 0; j < path.rows(); ++j) sum = sum + columns_[path.first_number + n * path.room + j] * of_path[j];
        return sum;
      };
      each_velocity(path, [&](Index v, std::size_t n) { innovation(v) = innovation(v) - pushed(n); });
      for (const CouplingPath::Passed& passed : path.passed) {
        const std::vector<std::size_t>& rows = closures()[passed.closure].rows;
        for (std::size_t i = 0; i < rows.size(); ++i) rho_[rows[i]] = rho_[rows[i]] - pushed(passed.at + i);
      }
    }
  }

  /// r - G^T dlambda, of the solve of a step made last.
  void subtract_push(Field<S>& residual) const { rows_.push(increment_, rows_.at_begin(), residual, minus); }
  /// And back to r.
  void add_push(Field<S>& residual) const { rows_.push(increment_, rows_.at_begin(), residual, plus); }
  /// p + G^T kappa, of the solve for velocities made last: what acts beside couplings, where p is what they have left of it.
  void add_pull(Field<S>& p) const { rows_.push(pull_, rows_.at_begin(), p, plus); }
  /// p - G^T kappa, likewise: all that there is of the momenta of these velocities.
  void take_pull(Field<S>& p) const { rows_.push(pull_, rows_.at_begin(), p, minus); }
  /// Of a step: before the evaluation that follows a solve, whatever becomes of the correction, in these lanes.
  void take_multipliers(const Mask& lanes, Field<S>& target) {
    if (empty()) return;
    rows_.push(increment_, rows_.at_begin(), target, [&](const S& now, const S& pushed) { return select(lanes, now + pushed, now); });
    for (std::size_t j = 0; j < rows(); ++j) lambda_[j] = select(lanes, lambda_[j] + increment_[j], lambda_[j]);
  }

  /// After the last evaluation of a step of h, before bodies are placed at its end: what rows that give way push there. Returns what they took [J].
  S end(double h) {
    if (!gives_way()) return S(0.0);
    const S loss = springs_.end(h, rows_.gaps(), pull_);
    std::ranges::fill(ends_.flat(), S(0.0));
    rows_.push(pull_, rows_.at_end(), ends_, plus);
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
    rows_.push(pull_, rows_.at_begin(), p, plus);
  }
  /// The same of steps of h in the place of that of steps of `from`, times `times`: p of a state that goes on with another step.
  void change_step(double from, double h, double times, Field<S>& p) {
    if (!gives_way() || from == h) return;
    for (const auto& [step, sign] : {std::pair(from, 1.0), std::pair(h, -1.0)}) {
      springs_.excess(step, {}, pull_);
      for (S& pull : pull_) pull = as<S>(sign * times) * pull;
      rows_.push(pull_, rows_.at_begin(), p, plus);
    }
  }
  /// Momenta less all of that: those that are read as velocities v.
  void take_excess(double h, const Field<S>& v, Field<S>& p) {
    if (!gives_way()) return;
    std::vector<S> opening(rows(), S(0.0));
    for (const CouplingPath& path : paths().all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) opening[row] = rows_.opening_of(path, row, v);
    }
    springs_.excess(h, opening, pull_);
    rows_.push(pull_, rows_.at_begin(), p, minus);
  }
  /// Of rows that give way, at q^k [J].
  S potential() const { return springs_.potential(); }

  /// What rounding of places and of multipliers makes of the squared energy norm, in squares of epsilon.
  S rounding() const {
    using std::abs;
    S sum(0.0);
    each_row([&](std::size_t row, const ClosureFactor& factor, std::size_t k) {
      const S& scale = rows_.scales()[row];
      const S size = scale * rows_.sizes()[row], pushed = (lambda_[row] + increment_[row]) / scale;
      sum = sum + size * size * abs(factor.solve.inverse(k)) + pushed * pushed * abs(factor.moved_by_itself[k]);
    });
    return sum;
  }

  S openness() const { return rows_.openness(); }
  S widest_gap() const { return rows_.widest_gap(); }
  std::size_t rows() const { return rows_.count(); }
  bool is_rigid(std::size_t row) const { return rows_.is_rigid(row); }
  const S& gap(std::size_t row) const { return rows_.gaps()[row]; }
  const S& size(std::size_t row) const { return rows_.sizes()[row]; }
  /// Times h^2; of the step solved last.
  S multiplier(std::size_t row) const {
    const S at_begin = lambda_[row] + increment_[row];
    return is_rigid(row) ? at_begin : springs_.whole(row, at_begin);
  }
  /// Whether a row is held by others already: its gap is watched, nothing pushes along it.
  auto is_held_already(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    return is_rigid(row) && factor->solve.inverse(k) == S(0.0);
  }
  const S& pivot(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    return factor->solve.pivot(k);
  }
  /// How far a unit of impulse along a row opens it, with the factor made last, loops beyond closed and others open.
  S yield(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    const S& scale = rows_.scales()[row];
    return factor->moved_by_itself[k] / (scale * scale);
  }
  const Coupling& coupling_of(std::size_t row) const { return *paths().path_of(row).coupling; }

 private:
  static constexpr std::size_t kSix = Side::room(6);  // numbers of a wrench or a twist
  static constexpr auto plus = [](const S& now, const S& pushed) { return now + pushed; };
  static constexpr auto minus = [](const S& now, const S& pushed) { return now - pushed; };

  /// Of the rows that close together.
  struct ClosureFactor {
    explicit ClosureFactor(std::size_t rows)
        : solve(rows), fresh(rows), moved_by_itself(rows, S(0.0)), up(kSix * rows, S(0.0)), down(kSix * rows, S(0.0)), right_side(rows, S(0.0)) {}
    MaskedSolve<S> solve, fresh;
    std::vector<S> moved_by_itself;  // diagonal of S, scaled
    std::vector<S> up, down;         // b of each column, S^-1 y^T
    std::vector<S> right_side;       // scratch
  };

  const CouplingPaths& paths() const { return rows_.paths(); }
  std::span<const Closure> closures() const { return rows_.paths().closures(); }
  /// Where a row is among those that close with it.
  std::pair<const ClosureFactor*, std::size_t> place_of(std::size_t row) const {
    const CouplingPath& path = paths().path_of(row);
    return {&factors_[path.closure], path.first_in_closure + (row - path.first_row)};
  }
  /// visit(row, factor, number of the row in it).
  template <class Visit>
  void each_row(const Visit& visit) const {
    for (std::size_t closure = 0; closure < factors_.size(); ++closure) {
      for (std::size_t k = 0; k < closures()[closure].rows.size(); ++k) visit(closures()[closure].rows[k], factors_[closure], k);
    }
  }
  /// visit(velocity row, where it is among the path's numbers).
  template <class Visit>
  static void each_velocity(const CouplingPath& path, const Visit& visit) {
    for (std::size_t n = 0; n < path.velocities; ++n) visit(path.velocity_rows[n], n);
  }

  /// visit(number of the row, its number) of rows from `first` on that are in the lanes of a register.
  template <class Visit>
  static void each_row_of(const CouplingPath& path, std::size_t first, const Pack& value, const Visit& visit) {
    std::array<S, Side::count> numbers;
    Side::store(value, numbers.data());
    for (std::size_t l = 0; l < Side::count && first + l < path.rows(); ++l) visit(first + l, numbers[l]);
  }
  /// What a joint's numbers become, in these lanes of instances; to: of the first row.
  template <JointKind Kind>
  static void put(Joint<Kind>, const Wrench<Pack>& value, const Mask& lanes, std::size_t room, S* to) {
    Pack now[6];
    value.to(now);
    for (std::size_t k = 0; k < static_cast<std::size_t>(velocity_count(Kind)); ++k) Side::store(lanes, now[k], to + k * room);
  }
  /// Rows from `first` on of G or J, joint by joint; none above those that move the bodies against each other.
  static auto rows_of_path(const CouplingPath& path, std::size_t first, const std::vector<S>& numbers) {
    return [&path, from = &numbers[path.first_velocity + first]]<JointKind Kind>(Joint<Kind>, std::size_t k) {
      Pack row[6];
      const auto at = static_cast<std::size_t>(path.joints[k].at), count = static_cast<std::size_t>(velocity_count(Kind));
      for (std::size_t n = 0; n < 6; ++n) row[n] = n < count && at < path.on_path ? Side::load(from + (at + n) * path.room) : Pack(0.0);
      return Wrench<Pack>::from(row);
    };
  }

  /// What is left of columns of G^T where joints, and loops that are closed below, have yielded.
  template <class Element, class PlacementOf>
  void column_up(const CouplingPath& path, std::size_t first, const BodyConstants<Element>& constants, const PlacementOf& placement_of,
                 const Gains<S>& gains, const Mask& lanes) {
    S* const numbers = &columns_[path.first_number + first];
    const auto past = [&](const CouplingPath::Passed& passed, std::size_t first_meeting) {
      const Closure& below = closures()[passed.closure];
      std::size_t at = 0;
      for (std::size_t m = 0; m < below.paths.size(); ++m) {
        const CouplingPath::Meeting& meeting = path.meetings[first_meeting + m];
        const CouplingPath& other = paths().all()[meeting.path];
        for (std::size_t i = 0; i < other.rows(); ++i, ++at) {
          const S* const y = &across_[other.first_number + i];
          Pack sum(0.0);
          each_shared(meeting, [&](std::size_t n, std::size_t of_other) { sum = sum + Pack(y[of_other * other.room]) * Side::load(numbers + n * path.room); });
          right_sides_[at] = sum;
        }
      }
      solve(passed.closure, right_sides_.data());
      Wrench<Pack> sum = no_wrench();
      for (std::size_t i = 0; i < at; ++i) {
        Side::store(lanes, right_sides_[i], numbers + (passed.at + i) * path.room);
        sum = sum + right_sides_[i] * spread<Pack>(Wrench<S>::from(&factors_[passed.closure].up[kSix * i]));
      }
      return sum;
    };
    const auto keep = [&](auto joint, std::size_t k, const Wrench<Pack>& u) { put(joint, u, lanes, path.room, numbers + number_of(path, k) * path.room); };
    way_up(path, constants, placement_of, gains.up, rows_of_path(path, first, rows_.at_begin()), past, keep);
    keep_passed(path, first, lanes, factors_[path.closure].up);
  }
  /// What rows of J become: of each joint the number that u counts by.
  template <class Element, class PlacementOf>
  void row_up(const CouplingPath& path, std::size_t first, const std::vector<S>& jacobian, const BodyConstants<Element>& constants,
              const PlacementOf& placement_of, const Gains<S>& gains, const Mask& lanes) {
    S* const numbers = &across_[path.first_number + first];
    const auto past = [&](const CouplingPath::Passed& passed, std::size_t first_meeting) {
      const Closure& below = closures()[passed.closure];
      Wrench<Pack> sum = no_wrench();
      std::size_t at = 0;
      for (std::size_t m = 0; m < below.paths.size(); ++m) {
        const CouplingPath::Meeting& meeting = path.meetings[first_meeting + m];
        const CouplingPath& other = paths().all()[meeting.path];
        for (std::size_t i = 0; i < other.rows(); ++i, ++at) {
          const S* const x = &columns_[other.first_number + i];
          Pack moved(0.0);
          each_shared(meeting, [&](std::size_t n, std::size_t of_other) { moved = moved + Side::load(numbers + n * path.room) * Pack(x[of_other * other.room]); });
          Side::store(lanes, Pack(0.0) - moved, numbers + (passed.at + at) * path.room);
          sum = sum + moved * spread<Pack>(Wrench<S>::from(&factors_[passed.closure].down[kSix * at]));
        }
      }
      return sum;
    };
    const auto keep = [&](auto joint, std::size_t k, const Wrench<Pack>& y) {
      put(joint, apply_inverse_transposed(joint, gains.inverse, model_.tree.first_block(path.slots[k]), y), lanes, path.room,
          numbers + number_of(path, k) * path.room);
    };
    way_up(path, constants, placement_of, gains.down, rows_of_path(path, first, jacobian), past, keep);
    keep_passed(path, first, lanes, factors_[path.closure].down);
  }
  /// past(passed, first of its meetings): what the body where it closes gets less.
  template <class Element, class PlacementOf, class Given, class Past, class Keep>
  void way_up(const CouplingPath& path, const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Field<S, 6>& gain,
              const Given& given, const Past& past, const Keep& keep) {
    auto next = path.passed.begin();
    std::size_t meeting = closures()[path.closure].paths.size();
    impulse_along_up(
        model_.tree, constants, placement_of, gain, path.slots, path.closes_at,
        [&](Index slot) {
          for (; next != path.passed.end() && slot_of(next->closure) == slot; ++next) {
            store(bias_, slot, load<Wrench, Pack>(bias_, slot) - past(*next, meeting));
            meeting += closures()[next->closure].paths.size();
          }
        },
        given, keep, bias_);
  }
  static Wrench<Pack> no_wrench() {
    const Vec3<Pack> zero{Pack(0.0), Pack(0.0), Pack(0.0)};
    return {zero, zero};
  }
  static std::size_t number_of(const CouplingPath& path, std::size_t joint) { return static_cast<std::size_t>(path.joints[joint].at); }
  /// visit(number of the one path, number of the other) of what they share.
  template <class Visit>
  static void each_shared(const CouplingPath::Meeting& meeting, const Visit& visit) {
    for (const CouplingPath::Shared& shared : meeting.shared) {
      for (std::size_t k = 0; k < shared.count; ++k) visit(shared.at_first + k, shared.at_second + k);
    }
  }
  /// What has come to the body where a path closes, of its rows from `first` on.
  void keep_passed(const CouplingPath& path, std::size_t first, const Mask& lanes, std::vector<S>& kept) {
    const Index slot = path.closes_at;
    if (slot == 0) return;
    for (int c = 0; c < 6; ++c) {
      each_row_of(path, first, bias_(slot, c), [&](std::size_t j, const S& now) {
        S& number = kept[kSix * (path.first_in_closure + j) + static_cast<std::size_t>(c)];
        number = select(lanes, now, number);
      });
    }
  }

  /// S^-1 of right sides of a closure, in place; R: S, or several of them in lanes.
  template <class R>
  void solve(std::size_t closure, R* right_sides) const {
    const std::vector<std::size_t>& rows = closures()[closure].rows;
    for (std::size_t k = 0; k < rows.size(); ++k) right_sides[k] = R(rows_.scales()[rows[k]]) * right_sides[k];
    factors_[closure].solve.solve(right_sides);
    for (std::size_t k = 0; k < rows.size(); ++k) right_sides[k] = R(rows_.scales()[rows[k]]) * right_sides[k];
  }

  /// S of the rows of a closure, scaled, from rows and columns, and its factor; y^T becomes S^-1 y^T.
  void factor(std::size_t closure, Coupled of, std::size_t coordinates, const Mask& lanes, double damping) {
    const Closure& closes = closures()[closure];
    ClosureFactor& kept = factors_[closure];
    const std::vector<S>& scale = rows_.scales();
    for (const std::size_t k : closes.paths) {
      const CouplingPath& path = paths().all()[k];
      for (std::size_t m = 0; m < closes.paths.size(); ++m) {
        const CouplingPath::Meeting& meeting = path.meetings[m];
        const CouplingPath& other = paths().all()[meeting.path];
        for (std::size_t first = 0; first < other.rows(); first += Side::count) {
          Pack sums[6];
          std::ranges::fill(sums, Pack(0.0));
          each_shared(meeting, [&](std::size_t n, std::size_t of_other) {
            const S* const y = &across_[path.first_number + n * path.room];
            const Pack x = Side::load(&columns_[other.first_number + of_other * other.room + first]);
            for (std::size_t j = 0; j < path.rows(); ++j) sums[j] = sums[j] + Pack(y[j]) * x;
          });
          for (std::size_t j = 0; j < path.rows(); ++j) {
            const std::size_t row = path.first_row + j;
            each_row_of(other, first, sums[j], [&](std::size_t c, const S& product) {
              const std::size_t column = other.first_row + c;
              S sum = product;
              for (std::size_t n = 0; n < coordinates; ++n) sum = sum + tied_across_[row * coordinates + n] * tied_columns_[column * coordinates + n];
              kept.fresh.at(path.first_in_closure + j, other.first_in_closure + c) = scale[row] * (scale[column] * sum);
            });
          }
        }
      }
    }
    for (std::size_t j = 0; j < closes.rows.size(); ++j) {
      const std::size_t row = closes.rows[j];
      S& diagonal = kept.fresh.at(j, j);
      kept.moved_by_itself[j] = select(lanes, diagonal, kept.moved_by_itself[j]);
      diagonal = diagonal + as<S>(damping);
      if (!is_rigid(row)) diagonal = diagonal + scale[row] * scale[row] * as<S>(springs_.yield(of, row));
    }
    kept.fresh.factor();
    kept.solve.take(kept.fresh, lanes);
    if (closes.slot == 0) return;
    for (std::size_t c = 0; c < 6; c += Side::count) {
      for (std::size_t j = 0; j < closes.rows.size(); ++j) right_sides_[j] = Side::load(&kept.down[kSix * j + c]);
      solve(closure, right_sides_.data());
      for (std::size_t j = 0; j < closes.rows.size(); ++j) Side::store(lanes, right_sides_[j], &kept.down[kSix * j + c]);
    }
  }
  /// b S^-1 y^T.
  std::array<S, 36> felt_above(std::size_t closure) const {
    std::array<S, 36> felt;
    felt.fill(S(0.0));
    if (slot_of(closure) == 0) return felt;
    const ClosureFactor& kept = factors_[closure];
    for (std::size_t k = 0; k < kept.right_side.size(); ++k) {
      const S *const up = &kept.up[kSix * k], *const down = &kept.down[kSix * k];
      for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < 6; ++c) {
          S& number = felt[static_cast<std::size_t>(row_start(r) + column_start(c))];
          number = number + up[r] * down[c];
        }
      }
    }
    return felt;
  }

  /// What coordinates that are tied feel of impulses, as rows.
  template <class Element, class PlacementOf>
  void feel(const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Gains<S>& gains, const MimicTies<S>& ties, const Mask& lanes) {
    const std::span<const Index> slots = paths().reached();
    for (std::size_t c = 0; c < ties.coordinates(); ++c) {
      std::ranges::fill(tied_.flat(), S(0.0));
      ties.each_member([&](Index, Index row, double multiplier, std::size_t coordinate) {
        if (coordinate == c) tied_(row) = as<S>(kHold<S> * multiplier);
      });
      impulse_along_up(
          model_.tree, constants, placement_of, gains.down, slots, 0, [](Index) {},
          [&](auto joint, std::size_t k) { return load_joint(joint, tied_, model_.tree.first_v(slots[k])); },
          [&](auto joint, std::size_t k, const Wrench<S>& y) {
            const Index v = model_.tree.first_v(slots[k]);
            S now[6];
            apply_inverse_transposed(joint, gains.inverse, model_.tree.first_block(slots[k]), y).to(now);
            for (Index n = 0; n < velocity_count(joint); ++n) felt_[c](v + n) = select(lanes, now[n], felt_[c](v + n));
          },
          tied_bias_);
    }
  }
  /// How the coordinates move by each column of a path, and how they move its rows.
  void move_ties(const CouplingPath& path, MimicTies<S>& ties) {
    for (std::size_t j = 0; !ties.empty() && j < path.rows(); ++j) {
      moved_ties(ties, path.slots, [&](Index, std::size_t n) { return columns_[path.first_number + n * path.room + j]; });
      std::ranges::copy(*tied_moved_, tied_columns_.begin() + static_cast<std::ptrdiff_t>((path.first_row + j) * pulls_.size()));
    }
  }
  void cross_ties(const CouplingPath& path, const std::vector<S>& jacobian, const MimicTies<S>& ties, const Mask& lanes) {
    for (std::size_t c = 0; c < ties.coordinates(); ++c) {
      for (std::size_t j = 0; j < path.rows(); ++j) {
        S sum(0.0);
        rows_.each_on_path(path, [&](Index v, std::size_t n) { sum = sum + jacobian[path.first_velocity + n * path.room + j] * ties.response(c)(v); });
        S& kept = tied_across_[(path.first_row + j) * ties.coordinates() + c];
        kept = select(lanes, sum, kept);
      }
    }
  }
  /// How these coordinates move; u(velocity row, its number among those of the slots).
  template <class Innovation>
  void moved_ties(MimicTies<S>& ties, std::span<const Index> slots, const Innovation& u) {
    for (std::size_t c = 0; c < pulls_.size(); ++c) {
      pulls_[c] = S(0.0);
      std::size_t n = 0;
      for (const Index i : slots) {
        for (Index k = 0; k < velocity_count(model_.tree.kind(i)); ++k) {
          const Index v = model_.tree.first_v(i) + k;
          pulls_[c] = pulls_[c] + felt_[c](v) * u(v, n++);
        }
      }
    }
    tied_moved_ = &ties.moved_by(pulls_);
  }

  const Model& model_;
  CouplingRows<S, Side> rows_;
  std::vector<S> lambda_;
  std::vector<S> increment_;  // of lambda, by the solve made last
  std::vector<S> pull_;       // likewise, of velocities and positions
  std::vector<S> rho_;        // of the solve there is
  std::vector<S> across_;     // of each number of a path and row: how u counts there, of closures their rho
  std::vector<S> columns_;    // of each number of a path and column: u, of closures rho
  std::vector<ClosureFactor> factors_;
  CouplingSprings<S> springs_;
  Field<S> ends_;             // what springs push at the end of a step
  Field<Pack, 6> bias_;       // scratch
  std::vector<Pack> right_sides_;  // likewise
  // where joints are tied
  std::vector<Field<S>> felt_;                  // of each coordinate, how u counts for it
  std::vector<S> tied_across_, tied_columns_;   // of each row and coordinate
  std::vector<S> pulls_;                        // scratch
  const std::vector<S>* tied_moved_ = nullptr;  // by the solve there is
  Field<S> tied_;                               // scratch
  Field<S, 6> tied_bias_;                       // likewise
};

}  // namespace linden
