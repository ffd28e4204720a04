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
// at the world is solved by one dense matrix a set of them that share joints, over the paths; contacts, which all close there, by a sparse one.
//
// Multipliers are carried times h, like all impulses of a step. The residual is linear in them, so what they begin with changes no correction that
// is made with a factor of the step itself: they begin at zero. A factor of an earlier step pushes along where rows were then, and is wrong by
// that share of what is left to push; where factors outlast steps multipliers begin with the polynomial through those of the last steps, as
// displacements do. They are corrected with the displacement, whole, in part, or back again. What has not been applied is found anew, to the
// bit, by whoever evaluates the same displacement once more: lanes that wait for others.
//
// cost    a factor: two sweeps over the path of each row, products of rows where paths meet; a solve: numbers of all paths, twice
// source  Andersen 1983 (RATTLE); Featherstone, Rigid Body Dynamics Algorithms, ch. 8 (loop joints), 8.5 (loops within a tree's solve)
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/sweeps/closure_factors.hpp"
#include "engine/sweeps/coupling_rows.hpp"
#include "engine/sweeps/coupling_springs.hpp"
#include "kernels/block/evaluate_down.hpp"
#include "kernels/couplings/contact_solve.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/values/lanes_of.hpp"
#include "layout/model.hpp"
#include "layout/state.hpp"

namespace linden {

/// How long the factor of a step is to serve: till another is made, of whatever, or for steps that follow, so that others have one of their own.
enum class Serves : std::uint8_t { till_the_next, steps_that_follow };

/// Rows that a contact can have.
inline constexpr std::size_t kMostContactRows = 6;

/// Pack: what rows of a coupling are side by side in (row_lanes.hpp).
template <class S, class Pack = RowPack<S>>
class CouplingSweeps {
 public:
  using Mask = typename LanesOf<S>::Mask;
  using Side = RowLanes<S, Pack>;

  /// yields: of each row (coupling_yields.hpp); empty where none gives way. contacts: beside the couplings of the model (layout/couplings.hpp); what
  /// they are made of must outlive it, and may change from step to step. Not where factors outlast steps.
  CouplingSweeps(const Model& model, std::span<const double> yields, Serves serves = Serves::till_the_next, Closing closing = Closing::nearest,
                 std::span<const Coupling> contacts = {})
      : model_(model), rows_(model, closing, contacts), of_step_(model, rows_), laws_(contacts.size()) {
    if (serves == Serves::steps_that_follow && !empty()) {
      of_others_.emplace(model, rows_);
      history_.allocate(static_cast<Index>(rows()), S(0.0));
      factored_.assign(rows_.paths().velocities(), S(0.0));
    }
    for (std::vector<S>* each : {&lambda_, &increment_, &applied_, &pull_}) each->assign(rows(), S(0.0));
    if (!empty()) unpushed_.allocate(model.tree.shape.velocities);
    for (const CouplingPath& path : all()) {
      for (std::size_t row = 0; row < path.rows(); ++row) {
        const Compliance& compliance = compliance_of(*path.coupling, rows_of(*path.coupling)[row]);
        if (compliance.gives_way()) springs_.add(path.first_row + row, compliance, yields.empty() ? 0 : yields[path.first_row + row]);
      }
    }
    if (gives_way()) ends_.allocate(model.tree.shape.velocities, S(0.0));
    if (!contacts.empty()) guess_.assign(rows(), S(0.0));
    if constexpr (std::is_same_v<S, double>) prepare_contacts();
  }

  CouplingSweeps(const CouplingSweeps&) = delete;
  CouplingSweeps& operator=(const CouplingSweeps&) = delete;

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
    due_ = 0;
    is_unpushed_ = true;
    springs_.begin(h);
  }
  /// Whether steps begin with multipliers of those before: see guess.
  bool has_history() const { return of_others_.has_value(); }
  /// After begin: multipliers that the first evaluation takes, the last ones with these shares, latest first.
  void guess(std::span<const double> shares) {
    for (std::size_t row = 0; row < rows(); ++row) {
      applied_[row] = S(0.0);
      // what others hold already could be any number, and would grow from step to step
      for (std::size_t k = 0; k < shares.size() && of_step_.inverse(row) != S(0.0); ++k) {
        applied_[row] = applied_[row] + as<S>(shares[k]) * history_(static_cast<Index>(row), static_cast<int>(k));
      }
    }
    due_ = 1;
  }
  /// The step is solved: its multipliers become the latest.
  void remember() {
    for (Index row = 0; has_history() && row < history_.rows(); ++row) {
      for (int k = kHistory - 1; k > 0; --k) history_(row, k) = history_(row, k - 1);
      const auto at = static_cast<std::size_t>(row);
      history_(row, 0) = lambda_[at] + increment_[at];
    }
  }
  /// Steps are so many times as long from now on; multipliers are impulses times h.
  void change_length(double times) {
    for (S& multiplier : history_.flat()) multiplier = as<S>(times * times) * multiplier;
  }
  /// Gaps at the end of motions of the joints; rows: and how joints change them there, before a factor is made.
  void find_gaps(const Field<S, 12>& placement, const Field<S, 7>& motion, const Field<S>& delta, Asked asked) {
    if (!empty()) rows_.find_gaps(placement, motion, delta, gives_way() ? Asked::rows : asked);
  }
  /// After it, those of contacts, of bodies in the world at q^k that are displaced so.
  void find_contact_gaps(const Field<S, 12>& world, const Field<S, 7>& displacement) { rows_.find_contact_gaps(world, displacement); }

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
    const auto added = [&](std::size_t row) {
      const S& scale = rows_.scales()[row];
      if (is_rigid(row)) return as<S>(damping);
      return as<S>(damping) + scale * scale * as<S>(springs_.yield(of, row));
    };
    const std::vector<S>& jacobian = of == Coupled::step ? rows_.at_end() : rows_.at_begin();
    ClosureFactors<S, Pack>& factors = factors_of(of);
    made_last_ = &factors;
    contact_solves_.renew(closure);
    for (const std::size_t k : closures()[closure].paths) {
      if (of == Coupled::step && has_history()) keep_rows(all()[k]);
    }
    if (motion != nullptr) return factors.close(closure, jacobian, constants, here, at_end, gains, ties, lanes, added);
    return factors.close(closure, jacobian, constants, here, here, gains, ties, lanes, added);
  }

  /// Before the first half of a solve. given: velocities that are there beside those that are solved for; null: none.
  void begin_solve(Coupled of, const Field<S>* given = nullptr) {
    if (empty()) return;
    std::vector<S>& rho = factors_of(of).rho();
    for (const CouplingPath& path : all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) {
        rho[row] = of == Coupled::velocities || of == Coupled::reading ? S(0.0) : S(0.0) - rows_.gaps()[row];
        if (given != nullptr) rho[row] = rho[row] + rows_.opening_of(path, row, *given);
      }
    }
    if (of == Coupled::step) springs_.complete(lambda_, rho);
  }
  /// Within up_to_closures of the first half of a solve, whose innovation, u of r, is that of the bodies beyond: of the bias, what was passed up
  /// to bodies, that of the body where it closes.
  void yield(std::size_t closure, Coupled of, MimicTies<S>& ties, const Field<S>& innovation, Field<S, 6>& bias) {
    factors_of(of).yield(closure, ties, innovation, bias, [&](std::size_t touching, auto& right_side) {
      if constexpr (std::is_same_v<S, double>) {
        if (of == Coupled::step) touch(touching, right_side);
      }
      return std::is_same_v<S, double> && of == Coupled::step;
    });
  }
  /// Within down_from_closures of the second half of a solve, where it is known how the body where it closes moves: the innovation of joints
  /// beyond becomes that of r - G^T dlambda.
  void push(std::size_t closure, Coupled of, const Field<S, 6>& variation, Field<S>& innovation) {
    factors_of(of).push(closure, variation, innovation, of == Coupled::step ? increment_ : pull_);
  }

  /// r.Delta beyond Delta.A Delta, of the solve of a step made last, where r is what it leaves by rows as they are, and Delta by those of its factor.
  S beyond_norm(const Field<S>& increment) const {
    S sum(0.0);
    if (!has_history()) return sum;
    for (const CouplingPath& path : all()) {
      rows_.each_on_path(path, [&](Index v, std::size_t n) {
        const std::size_t first = path.first_velocity + n * path.room;
        S turned(0.0);
        for (std::size_t j = 0; j < path.rows(); ++j) turned = turned + increment_[path.first_row + j] * (factored_[first + j] - rows_.at_begin()[first + j]);
        sum = sum + turned * increment(v);
      });
    }
    return sum;
  }
  /// r - G^T dlambda, of the solve of a step made last.
  void subtract_push(Field<S>& residual) const { rows_.push(increment_, rows_.at_begin(), residual, minus); }
  /// And back to r.
  void add_push(Field<S>& residual) const { rows_.push(increment_, rows_.at_begin(), residual, plus); }
  /// p + G^T kappa, of the solve for velocities made last: what acts beside couplings, where p is what they have left of it.
  void add_pull(Field<S>& p) const { rows_.push(pull_, rows_.at_begin(), p, plus); }
  /// p - G^T kappa, likewise: all that there is of the momenta of these velocities.
  void take_pull(Field<S>& p) const { rows_.push(pull_, rows_.at_begin(), p, minus); }
  /// What the solve made last found is the correction that is applied.
  void apply() { std::swap(increment_, applied_); }
  /// The correction applied last, times `factor`, is due.
  void correct(double factor) { due_ = factor; }
  /// In an evaluation of a step: multipliers get what is due, in these lanes, and the target, which is that of the step without multipliers the first
  /// time, what they push. Each time from there: a correction far off that is taken back leaves nothing of its rounding.
  void take_multipliers(const Mask& lanes, Field<S>& target) {
    if (empty() || due_ == 0) return;
    if (is_unpushed_) std::ranges::copy(target.flat(), unpushed_.flat().begin());
    is_unpushed_ = false;
    for (std::size_t j = 0; j < rows(); ++j) lambda_[j] = select(lanes, lambda_[j] + as<S>(due_) * applied_[j], lambda_[j]);
    due_ = 0;
    for (const CouplingPath& path : all()) {
      rows_.each_on_path(path, [&](Index v, std::size_t) { target(v) = unpushed_(v); });
    }
    rows_.push(lambda_, rows_.at_begin(), target, plus);
  }

  std::size_t contacts() const { return laws_.size(); }
  /// After begin: the law of a contact in this step, and the impulse along its rows that is to be expected.
  void set_contact(std::size_t contact, const ContactLaw& law, const std::array<double, kMostContactRows>& guess) {
    laws_[contact] = law;
    const CouplingPath& path = path_of(contact);
    for (std::size_t j = 0; j < path.rows(); ++j) guess_[path.first_row + j] = as<S>(guess[j]);
  }
  /// By how much a displacement changes the gap of a contact, from where bodies are at the beginning.
  S opened(std::size_t contact, const Field<S>& displacement) const { return opening(path_of(contact).first_row + 2, displacement); }
  /// Of the step solved last: the impulse along each of its rows, times h; how far each opens at its beginning in the mean of it and of the step
  /// before, of these displacements: what an impulse between the two works along. Before bodies are placed at its end. Zero of rows that it has not.
  std::array<S, kMostContactRows> impulse_of(std::size_t contact) const {
    const CouplingPath& path = path_of(contact);
    std::array<S, kMostContactRows> impulse{};
    for (std::size_t j = 0; j < path.rows(); ++j) impulse[j] = lambda_[path.first_row + j] + increment_[path.first_row + j];
    return impulse;
  }
  std::array<S, kMostContactRows> opens(std::size_t contact, const Field<S>& before, const Field<S>& now) const {
    const CouplingPath& path = path_of(contact);
    std::array<S, kMostContactRows> mean{};
    for (std::size_t j = 0; j < path.rows(); ++j) {
      const std::size_t row = path.first_row + j;
      mean[j] = S(0.5) * (rows_.opening_of(path, row, before) + rows_.opening_of(path, row, now));
    }
    return mean;
  }
  /// to += share of what contacts pushed, with bodies where they are.
  void add_contacts(double share, Field<S>& to) {
    std::ranges::fill(pull_, S(0.0));
    for (std::size_t row = rows_.paths().lasting_rows(); row < rows(); ++row) pull_[row] = as<S>(share) * (lambda_[row] + increment_[row]);
    rows_.push(pull_, rows_.at_begin(), to, plus);
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
    for (const CouplingPath& path : all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) opening[row] = rows_.opening_of(path, row, v);
    }
    springs_.excess(h, opening, pull_);
    rows_.push(pull_, rows_.at_begin(), p, minus);
  }
  /// Whether rows that give way work otherwise in the step solved last, of h and of this displacement, than their gaps change, by more than this share
  /// of the energies that move them, h^2 x kinetic and their own.
  auto strays(double share, double h, const S& kinetic, const Field<S>& delta) const {
    using std::abs, std::max;
    constexpr double kRounding = 1e3 * static_cast<double>(std::numeric_limits<typename ElementOf<S>::type>::epsilon());  // of a gap, beside its size
    S sum(0.0);
    for (const CouplingPath& path : all()) {
      for (std::size_t row = path.first_row; row < path.last_row; ++row) {
        if (is_rigid(row)) continue;
        const S begin = rows_.opening_of(path, row, rows_.at_begin(), delta), end = rows_.opening_of(path, row, rows_.at_end(), delta);
        const S farther = abs(springs_.strays(row, gap(row), begin, end)) - as<S>(kRounding) * size(row);
        sum = sum + abs(multiplier(row)) * max(farther, S(0.0));
      }
    }
    return sum > as<S>(share) * (kinetic + as<S>(h * h) * potential());
  }
  /// Of rows that give way, at q^k [J].
  S potential() const { return springs_.potential(); }

  /// What rounding of places and of multipliers makes of the squared energy norm, in squares of epsilon.
  S rounding() const {
    using std::abs;
    S sum(0.0);
    of_step_.each_row([&](std::size_t row, const S& inverse, const S& moved_by_itself) {
      const S& scale = rows_.scales()[row];
      const S size = scale * rows_.sizes()[row], pushed = (lambda_[row] + increment_[row]) / scale;
      S holds = abs(inverse);
      if (touches(row)) holds = select(pushed == S(0.0), S(0.0), S(1.0) / abs(moved_by_itself));  // what sticks, or is pressed, all but holds
      sum = sum + size * size * holds + pushed * pushed * abs(moved_by_itself);
    });
    return sum;
  }

  S openness() const { return rows_.openness(); }
  S widest_gap() const { return rows_.widest_gap(); }
  /// The same of those that are pushed along, by the factor of a step: others may be open by what axes are off.
  S widest_pushed_gap() const {
    using std::abs, std::max;
    S widest(0.0);
    of_step_.each_row([&](std::size_t row, const S& inverse, const S&) {
      if (is_rigid(row)) widest = max(widest, select(inverse == S(0.0), S(0.0), abs(gap(row)) / size(row)));
    });
    return widest;
  }
  std::size_t rows() const { return rows_.count(); }
  bool is_rigid(std::size_t row) const { return rows_.is_rigid(row); }
  const S& gap(std::size_t row) const { return rows_.gaps()[row]; }
  /// How fast it opens at q^k by these velocities.
  S opening(std::size_t row, const Field<S>& v) const { return rows_.opening_of(rows_.paths().path_of(row), row, v); }
  const S& size(std::size_t row) const { return rows_.sizes()[row]; }
  /// Times h^2; of the step solved last.
  S multiplier(std::size_t row) const {
    const S at_begin = lambda_[row] + increment_[row];
    return is_rigid(row) ? at_begin : springs_.whole(row, at_begin);
  }
  /// What multipliers of rigid rows of couplings, times h^2, work along a way of the joints from q^k.
  S rigid_work(const Field<S>& way) const {
    S sum(0.0);
    for (std::size_t row = 0; row < rows_.paths().lasting_rows(); ++row) {
      if (is_rigid(row)) sum = sum + multiplier(row) * opening(row, way);
    }
    return sum;
  }
  /// Whether a row is held by others already: its gap is watched, nothing pushes along it.
  auto is_held_already(std::size_t row) const { return is_rigid(row) && made_last_->inverse(row) == S(0.0); }
  /// How far a unit of impulse along a row opens it, with the factor made last, loops beyond closed and others open.
  S yield(std::size_t row) const { return made_last_->moved_by_itself(row) / (rows_.scales()[row] * rows_.scales()[row]); }
  /// visit(numbers) of all that outlasts a step: numbers is a span.
  template <class Visit>
  void each_kept(const Visit& visit) {
    of_step_.each(visit);
    visit(std::span(factored_));
    visit(history_.flat());
  }
  /// The same where an angle changes as fast as its bodies turn.
  S level_yield(std::size_t row) const { return yield(row) / rows_.steepness()[row]; }
  const Coupling& coupling_of(std::size_t row) const { return *rows_.paths().path_of(row).coupling; }

 private:
  static constexpr auto plus = [](const S& now, const S& pushed) { return now + pushed; };
  static constexpr auto minus = [](const S& now, const S& pushed) { return now - pushed; };

  static constexpr double kInfinite = std::numeric_limits<double>::infinity();

  bool touches(std::size_t row) const { return row >= rows_.paths().lasting_rows(); }
  const CouplingPath& path_of(std::size_t contact) const { return all()[model_.couplings.size() + contact]; }
  void prepare_contacts() {
    for (std::size_t closure = 0; !laws_.empty() && closure < closures().size(); ++closure) {
      if (closures()[closure].touches()) contact_solves_.prepare(closure, of_step_.product_of(closure));
    }
  }
  /// Changes of multipliers with which contacts of a closure fulfil their laws, and its other rows open by what they are to.
  void touch(std::size_t closure, std::vector<S>& right_side) {
    const std::vector<std::size_t>& rows = closures()[closure].rows;
    for (std::vector<S>* numbers : {&yields_, &multipliers_, &changes_}) numbers->assign(rows.size(), S(0.0));
    firsts_.clear();
    laws_there_.clear();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::size_t row = rows[k];
      multipliers_[k] = lambda_[row];
      if (!touches(row)) {
        yields_[k] = is_rigid(row) ? (of_step_.inverse(row) == S(0.0) ? S(kInfinite) : S(0.0)) : S(springs_.yield(Coupled::step, row));
        continue;
      }
      changes_[k] = guess_[row] - lambda_[row];
    }
    for (const std::size_t k : closures()[closure].paths) {
      if (k < model_.couplings.size()) continue;
      firsts_.push_back(all()[k].first_in_closure);
      laws_there_.push_back(laws_[k - model_.couplings.size()]);
    }
    contact_solves_[closure].solve({yields_, firsts_, laws_there_, multipliers_, changes_}, right_side);
    for (std::size_t k = 0; k < rows.size(); ++k) guess_[rows[k]] = lambda_[rows[k]] + right_side[k];
  }

  void keep_rows(const CouplingPath& path) {
    const auto first = static_cast<std::ptrdiff_t>(path.first_velocity);
    std::copy_n(rows_.at_begin().begin() + first, path.room * path.velocities, factored_.begin() + first);
  }
  ClosureFactors<S, Pack>& factors_of(Coupled of) { return of == Coupled::step || !of_others_ ? of_step_ : *of_others_; }
  std::span<const Closure> closures() const { return rows_.paths().closures(); }
  std::span<const CouplingPath> all() const { return rows_.paths().all(); }

  const Model& model_;
  CouplingRows<S, Side> rows_;
  ClosureFactors<S, Pack> of_step_;
  std::optional<ClosureFactors<S, Pack>> of_others_;     // velocities and positions; none: the same serves for all
  const ClosureFactors<S, Pack>* made_last_ = &of_step_;
  CouplingSprings<S> springs_;
  std::vector<ContactLaw> laws_;          // of each contact
  std::vector<S> guess_;                  // of each row, the multiplier that a solve begins with
  ContactSolves contact_solves_;          // of each closure that has contacts
  std::vector<S> yields_, multipliers_, changes_;  // scratch: of the rows that close together
  std::vector<std::size_t> firsts_;                // likewise
  std::vector<ContactLaw> laws_there_;             // likewise
  std::vector<S> factored_;     // G that the factor of a step was made with, where it outlasts that
  Field<S, kHistory> history_;  // multipliers of the last steps, latest first; empty where no factor outlasts one
  std::vector<S> lambda_;
  std::vector<S> increment_;  // of lambda, by the solve made last
  std::vector<S> applied_;    // by the correction applied last
  double due_ = 0;            // share of it that multipliers are to get
  Field<S> unpushed_;         // target of the residual without multipliers
  bool is_unpushed_ = true;   // the target is that still
  std::vector<S> pull_;       // likewise, of velocities and positions
  Field<S> ends_;             // what springs push at the end of a step
};

}  // namespace linden
