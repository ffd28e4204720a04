// Rows of couplings as unknowns of a tree's elimination, closure by closure (coupling_paths.hpp): their factor, and solves with it. What is
// solved is in coupling_sweeps.hpp.
//
//   columns   of G^T, up the path: u of each joint, rho of each closure that is passed
//   across    rows of J likewise, as what u and rho count by:  J A^-1 r = across . (u of r)
//   up, down  what comes of both to the body where they close: b, and S^-1 y^T
//
//   S = across . columns,   rho = S^-1 (across . u - g),   dlambda = rho - down eta,   the body gets b rho less, and feels b down more
//
// Rows of contacts are not in this factor, nor is S of them ever formed: they are solved for by their laws (kernels/couplings/contact_solve.hpp), from
// across and columns (product_of), and are nothing where all else is held open.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "engine/sweeps/coupling_rows.hpp"
#include "engine/sweeps/coupling_ties.hpp"
#include "kernels/couplings/contact_solve.hpp"
#include "kernels/couplings/impulse_along_up.hpp"
#include "kernels/couplings/masked_solve.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/values/lanes_of.hpp"

namespace linden {

/// Pack: what rows of a coupling are side by side in (row_lanes.hpp).
template <class S, class Pack>
class ClosureFactors {
 public:
  using Mask = typename LanesOf<S>::Mask;
  using Side = RowLanes<S, Pack>;

  /// The rows must outlive it.
  ClosureFactors(const Model& model, const CouplingRows<S, Side>& rows) : model_(model), rows_(rows), ties_(model, rows.count()) {
    if (rows.empty()) return;
    bias_.allocate(model.tree.shape.slots);
    std::size_t most = 0;
    for (const Closure& closure : closures()) most = std::max(most, closure.lasting_rows);
    right_sides_.resize(most, Pack(0.0));
    rho_.assign(rows.count(), S(0.0));
    for (std::vector<S>* each : {&across_, &columns_}) each->assign(paths().numbers(), S(0.0));
    for (const Closure& closure : closures()) factors_.emplace_back(closure.rows.size(), closure.lasting_rows);
  }

  /// Once joints beyond the body where it closes have been taken out, with these gains; ties: factored. jacobian: J of rows; here and arrives: how
  /// impulses leave by joints, and poses arrive (kernels/tree/articulated.hpp). added(row): to the scaled diagonal of S. In these lanes the factor
  /// is the one to solve with from now on. Returns what the body where it closes feels of it, as Mat6 has it; for the world there is nothing.
  template <class Element, class Here, class Arrives, class Added>
  std::array<S, 36> close(std::size_t closure, const std::vector<S>& jacobian, const BodyConstants<Element>& constants, const Here& here,
                          const Arrives& arrives, const Gains<S>& gains, MimicTies<S>& ties, const Mask& lanes, const Added& added) {
    if (closure == 0) ties_.feel(constants, arrives, paths().reached(), gains, ties, lanes);
    for (const std::size_t k : closures()[closure].paths) {
      const CouplingPath& path = paths().all()[k];
      for (std::size_t first = 0; first < path.rows(); first += Side::count) column_up(path, first, constants, here, gains, lanes);
      for (std::size_t first = 0; first < path.rows(); first += Side::count) row_up(path, first, jacobian, constants, arrives, gains, lanes);
      ties_.cross(rows_, path, jacobian, [&](std::size_t n, std::size_t j) { return columns_[path.first_number + n * path.room + j]; }, ties, lanes);
    }
    factor(closure, lanes, added);
    return felt_above(closure);
  }

  /// Of each row: before the first half of a solve -g, or whatever it is to open by.
  std::vector<S>& rho() { return rho_; }
  /// In the first half of a solve, whose innovation, u of r, is that of the bodies beyond: rho, and of the bias, what was passed up to bodies, that
  /// of the body where it closes. touch(closure, right side): where contacts are among its rows, whether it has turned the right side into what
  /// fulfils their laws.
  template <class Touch>
  void yield(std::size_t closure, MimicTies<S>& ties, const Field<S>& innovation, Field<S, 6>& bias, const Touch& touch) {
    const Closure& closes = closures()[closure];
    ClosureFactor& kept = factors_[closure];
    if (closure == 0) ties_.move(paths().reached(), ties, [&](Index v, std::size_t) { return innovation(v); });
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
          kept.right_side[path.first_in_closure + j] = rho_[row] + along + ties_.opening(row);
        });
      }
    }
    if (!closes.touches() || !touch(closure, kept.right_side)) {
      solve(closure, kept.right_side.data());
      std::fill(kept.right_side.begin() + static_cast<std::ptrdiff_t>(closes.lasting_rows), kept.right_side.end(), S(0.0));
    }
    for (std::size_t k = 0; k < closes.rows.size(); ++k) rho_[closes.rows[k]] = kept.right_side[k];
    if (closes.slot == 0) return;
    for (int c = 0; c < 6; ++c) {
      S sum(0.0);
      for (std::size_t k = 0; k < closes.rows.size(); ++k) sum = sum + kept.up[kSix * k + static_cast<std::size_t>(c)] * kept.right_side[k];
      bias(closes.slot, c) = bias(closes.slot, c) - sum;
    }
  }
  /// In the second half, where it is known how the body where it closes moves: multipliers of its rows, and the innovation of joints beyond becomes
  /// that of r - G^T dlambda.
  void push(std::size_t closure, const Field<S, 6>& variation, Field<S>& innovation, std::vector<S>& multipliers) {
    const Closure& closes = closures()[closure];
    const ClosureFactor& kept = factors_[closure];
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

  /// What rows of a closure make of motions and impulses of joints, of closures that are passed, and of coordinates that are tied.
  ContactSolve::Product product_of(std::size_t closure) const {
    const Closure& closes = closures()[closure];
    ContactSolve::Product product;
    std::map<std::pair<bool, Index>, std::size_t> group_of;  // of a joint's slot; of a closure that is passed
    const auto group = [&](bool passed, Index number, std::size_t size) {
      const auto [found, is_new] = group_of.try_emplace({passed, number}, product.groups.size());
      if (is_new) product.groups.push_back({size, passed});
      return found->second;
    };
    for (const std::size_t k : closes.paths) {
      const CouplingPath& path = paths().all()[k];
      const std::size_t first_term = product.terms.size();
      const auto add = [&](std::size_t of, std::size_t number) {
        const std::size_t at = path.first_number + number * path.room;
        product.terms.push_back({of, &across_[at], &columns_[at], path.room, 1});
      };
      for (const CouplingPath::Joint& joint : path.joints) {
        add(group(false, joint.slot, static_cast<std::size_t>(velocity_count(model_.tree.kind(joint.slot)))), static_cast<std::size_t>(joint.at));
      }
      for (const CouplingPath::Passed& passed : path.passed) {
        add(group(true, static_cast<Index>(passed.closure), closures()[passed.closure].rows.size()), passed.at);
      }
      if (ties_.coordinates() > 0) {
        product.terms.push_back({group(false, 0, ties_.coordinates()), ties_.across(path.first_row), ties_.column(path.first_row), 1, ties_.coordinates()});
      }
      product.blocks.push_back({path.first_in_closure, path.rows(), first_term, product.terms.size(), is_contact(path.coupling->kind)});
    }
    return product;
  }

  /// Of the factor made last: 1 / pivot of a row, zero where it is held already, or a contact's; the pivot; how far a unit of impulse along a row opens it, times its
  /// scale squared, loops beyond closed and others open.
  S inverse(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    return factor->inverse(k);
  }
  const S& pivot(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    return factor->solve.pivot(k);
  }
  const S& moved_by_itself(std::size_t row) const {
    const auto [factor, k] = place_of(row);
    return factor->moved_by_itself[k];
  }
  /// visit(numbers) of all that it solves with: numbers is a span.
  template <class Visit>
  void each(const Visit& visit) {
    for (std::vector<S>* numbers : {&across_, &columns_}) visit(std::span(*numbers));
    for (ClosureFactor& factor : factors_) {
      factor.solve.each(visit);
      for (std::vector<S>* numbers : {&factor.moved_by_itself, &factor.up, &factor.down}) visit(std::span(*numbers));
    }
  }
  /// visit(row, inverse, moved_by_itself) of all.
  template <class Visit>
  void each_row(const Visit& visit) const {
    for (std::size_t closure = 0; closure < factors_.size(); ++closure) {
      const std::vector<std::size_t>& rows = closures()[closure].rows;
      for (std::size_t k = 0; k < rows.size(); ++k) visit(rows[k], factors_[closure].inverse(k), factors_[closure].moved_by_itself[k]);
    }
  }

 private:
  static constexpr std::size_t kSix = Side::room(6);  // numbers of a wrench or a twist

  /// Of the rows that close together.
  struct ClosureFactor {
    ClosureFactor(std::size_t rows, std::size_t lasting_rows)
        : solve(lasting_rows), fresh(lasting_rows), moved_by_itself(rows, S(0.0)), up(kSix * rows, S(0.0)), down(kSix * rows, S(0.0)),
          right_side(rows, S(0.0)), lasting(lasting_rows) {}
    S inverse(std::size_t k) const { return k < lasting ? solve.inverse(k) : S(0.0); }

    MaskedSolve<S> solve, fresh;     // of rows that are no contact's
    std::vector<S> moved_by_itself;  // diagonal of S, scaled
    std::vector<S> up, down;         // b of each column, S^-1 y^T
    std::vector<S> right_side;       // scratch
    std::size_t lasting;             // rows that are no contact's
  };

  const CouplingPaths& paths() const { return rows_.paths(); }
  std::span<const Closure> closures() const { return rows_.paths().closures(); }
  /// Where a row is among those that close with it.
  std::pair<const ClosureFactor*, std::size_t> place_of(std::size_t row) const {
    const CouplingPath& path = paths().path_of(row);
    return {&factors_[path.closure], path.first_in_closure + (row - path.first_row)};
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
    std::size_t meeting = path.met_in_closure;
    impulse_along_up(
        model_.tree, constants, placement_of, gain, path.slots, path.closes_at,
        [&](Index slot) {
          for (; next != path.passed.end() && closures()[next->closure].slot == slot; ++next) {
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
    const auto rows = std::span(closures()[closure].rows).first(closures()[closure].lasting_rows);
    for (std::size_t k = 0; k < rows.size(); ++k) right_sides[k] = R(rows_.scales()[rows[k]]) * right_sides[k];
    factors_[closure].solve.solve(right_sides);
    for (std::size_t k = 0; k < rows.size(); ++k) right_sides[k] = R(rows_.scales()[rows[k]]) * right_sides[k];
  }

  /// S of the rows of a closure, scaled, from rows and columns, and its factor; y^T becomes S^-1 y^T. Of contacts no more than the diagonal.
  template <class Added>
  void factor(std::size_t closure, const Mask& lanes, const Added& added) {
    const Closure& closes = closures()[closure];
    ClosureFactor& kept = factors_[closure];
    const std::vector<S>& scale = rows_.scales();
    for (const std::size_t k : closes.paths) {
      const CouplingPath& path = paths().all()[k];
      if (is_contact(path.coupling->kind)) {
        find_diagonal(path, lanes, kept.moved_by_itself);
        continue;
      }
      for (std::size_t m = 0; m < path.met_in_closure; ++m) {
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
              const S whole = product + ties_.product(row, column);
              const std::size_t at_row = path.first_in_closure + j, at_column = other.first_in_closure + c;
              kept.fresh.at(at_row, at_column) = scale[row] * (scale[column] * whole);
            });
          }
        }
      }
    }
    for (std::size_t j = 0; j < closes.lasting_rows; ++j) {
      const std::size_t row = closes.rows[j];
      S& diagonal = kept.fresh.at(j, j);
      kept.moved_by_itself[j] = select(lanes, diagonal, kept.moved_by_itself[j]);
      diagonal = diagonal + added(row);
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
  /// Of S, scaled, of a path's rows.
  void find_diagonal(const CouplingPath& path, const Mask& lanes, std::vector<S>& diagonal) const {
    for (std::size_t j = 0; j < path.rows(); ++j) {
      const std::size_t row = path.first_row + j;
      S sum = ties_.product(row, row);
      for (std::size_t n = 0; n < path.numbers; ++n) {
        const std::size_t at = path.first_number + n * path.room + j;
        sum = sum + across_[at] * columns_[at];
      }
      S& number = diagonal[path.first_in_closure + j];
      number = select(lanes, rows_.scales()[row] * (rows_.scales()[row] * sum), number);
    }
  }
  /// b S^-1 y^T.
  std::array<S, 36> felt_above(std::size_t closure) const {
    std::array<S, 36> felt;
    felt.fill(S(0.0));
    if (closures()[closure].slot == 0) return felt;
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

  const Model& model_;
  const CouplingRows<S, Side>& rows_;
  CouplingTies<S> ties_;
  std::vector<S> rho_;             // of the solve there is
  std::vector<S> across_;          // of each number of a path and row
  std::vector<S> columns_;         // of each number of a path and column
  std::vector<ClosureFactor> factors_;
  Field<Pack, 6> bias_;            // scratch
  std::vector<Pack> right_sides_;  // likewise
};

}  // namespace linden
