// Where joints are tied to each other (kernels/tree/mimic.hpp), what rows of couplings make of it: A is that of the tree with tied rows held, and
// their coordinates are further unknowns, whose share of S is (J X) T^-1 Z^T (1 - A A_held^-1) G^T. What a coordinate feels of impulses,
// Z^T (r - A A_held^-1 r), is kHold times the motion of its rows; so it is a row like others.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "engine/sweeps/coupling_rows.hpp"
#include "kernels/couplings/impulse_along_up.hpp"
#include "kernels/tree/mimic.hpp"

namespace linden {

template <class S>
class CouplingTies {
 public:
  /// rows: of all couplings.
  CouplingTies(const Model& model, std::size_t rows) : model_(model) {
    if (rows == 0) return;
    const std::size_t coordinates = MimicTies<S>(model.mimics, model.tree).coordinates();
    for (std::vector<S>* each : {&across_, &columns_}) each->assign(rows * coordinates, S(0.0));
    felt_.resize(coordinates);
    for (Field<S>& row : felt_) row.allocate(model.tree.shape.velocities);
    pulls_.assign(coordinates, S(0.0));
    if (coordinates == 0) return;
    tied_.allocate(model.tree.shape.velocities, S(0.0));
    bias_.allocate(model.tree.shape.slots);
  }

  /// What coordinates that are tied feel of impulses in the slots, as rows: with a factor just made, in these lanes.
  template <class Element, class PlacementOf, class Mask>
  void feel(const BodyConstants<Element>& constants, const PlacementOf& placement_of, std::span<const Index> slots, const Gains<S>& gains,
            const MimicTies<S>& ties, const Mask& lanes) {
    for (std::size_t c = 0; c < felt_.size(); ++c) {
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
          bias_);
    }
  }
  /// How coordinates move by each column of a path, u(number, column), and how they move its rows, of J in `jacobian`.
  template <class Rows, class Column, class Mask>
  void cross(const Rows& rows, const CouplingPath& path, const std::vector<S>& jacobian, const Column& u, MimicTies<S>& ties, const Mask& lanes) {
    for (std::size_t j = 0; !felt_.empty() && j < path.rows(); ++j) {
      move(path.slots, ties, [&](Index, std::size_t n) { return u(n, j); });
      std::ranges::copy(*moved_, columns_.begin() + static_cast<std::ptrdiff_t>((path.first_row + j) * felt_.size()));
      for (std::size_t c = 0; c < felt_.size(); ++c) {
        S sum(0.0);
        rows.each_on_path(path, [&](Index v, std::size_t n) { sum = sum + jacobian[path.first_velocity + n * path.room + j] * ties.response(c)(v); });
        S& kept = across_[(path.first_row + j) * felt_.size() + c];
        kept = select(lanes, sum, kept);
      }
    }
  }
  std::size_t coordinates() const { return felt_.size(); }
  /// Of a row: how coordinates move it, and how they move by its impulse, one after the other.
  const S* across(std::size_t row) const { return across_.data() + row * felt_.size(); }
  const S* column(std::size_t row) const { return columns_.data() + row * felt_.size(); }
  /// Their share of S.
  S product(std::size_t row, std::size_t column) const {
    S sum(0.0);
    for (std::size_t c = 0; c < felt_.size(); ++c) sum = sum + across_[row * felt_.size() + c] * columns_[column * felt_.size() + c];
    return sum;
  }

  /// How the coordinates move by impulses; u(velocity row, its number among those of the slots): what is left of them.
  template <class Innovation>
  void move(std::span<const Index> slots, MimicTies<S>& ties, const Innovation& u) {
    for (std::size_t c = 0; c < felt_.size(); ++c) {
      pulls_[c] = S(0.0);
      std::size_t n = 0;
      for (const Index i : slots) {
        for (Index k = 0; k < velocity_count(model_.tree.kind(i)); ++k) {
          const Index v = model_.tree.first_v(i) + k;
          pulls_[c] = pulls_[c] + felt_[c](v) * u(v, n++);
        }
      }
    }
    moved_ = &ties.moved_by(pulls_);
  }
  /// What a row opens by that.
  S opening(std::size_t row) const {
    S sum(0.0);
    for (std::size_t c = 0; c < felt_.size(); ++c) sum = sum + across_[row * felt_.size() + c] * (*moved_)[c];
    return sum;
  }

 private:
  const Model& model_;
  std::vector<Field<S>> felt_;               // of each coordinate, how u counts for it
  std::vector<S> across_, columns_;          // of each row and coordinate
  std::vector<S> pulls_;                     // scratch
  const std::vector<S>* moved_ = nullptr;    // by the impulses there are
  Field<S> tied_;                            // scratch
  Field<S, 6> bias_;                         // likewise
};

}  // namespace linden
