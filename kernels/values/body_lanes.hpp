// kernels/values/body_lanes.hpp
// Maps over the bodies of one tree, and scans where its levels are wide: a body in every lane.
//
//   for_bodies<S>(begin, end, [&](auto bodies, Index i) {        // S: what the fields hold
//     const auto D = gather<Displacement>(bodies, displacement, i);
//     scatter(bodies, twist, i, log(D));
//   });
//
// `bodies` is ManyBodies, i ... i + W - 1 in the lanes of a BodyPack, and at the end OneBody. A scan goes by for_same_level_down or _up:
// ManyBodies are of one level there, so none is the parent of another; gather_at reads the rows of their parents.
//
// Rows of a field lie one behind the other, so W of them are turned (rows into lanes) as they are read and written: some 3 shuffles a
// number and W bodies at W = 8. Where the lanes hold instances already (S is a pack) there is nothing to turn and the map goes body by
// body.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <xsimd/xsimd.hpp>

#include "kernels/values/spatial.hpp"
#include "layout/tree.hpp"

namespace linden {

/// As many bodies as a register of this compilation holds.
using BodyPack = xsimd::batch<double>;
inline constexpr int kBodies = static_cast<int>(BodyPack::size);

namespace turning {

using Register = double __attribute__((vector_size(sizeof(double) * kBodies)));
using Square = std::array<Register, static_cast<std::size_t>(kBodies)>;

LINDEN_INLINE Register read(const double* from) {
  Register value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Row l's number k becomes row k's number l.
template <class R, std::size_t W>
LINDEN_INLINE std::array<R, W> transposed(const std::array<R, W>& r) {
  if constexpr (W == 8) {
    const auto low1 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14); };
    const auto high1 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15); };
    const auto low2 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13); };
    const auto high2 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15); };
    const auto low4 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11); };
    const auto high4 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15); };
    const R a0 = low1(r[0], r[1]), a1 = high1(r[0], r[1]), a2 = low1(r[2], r[3]), a3 = high1(r[2], r[3]);
    const R a4 = low1(r[4], r[5]), a5 = high1(r[4], r[5]), a6 = low1(r[6], r[7]), a7 = high1(r[6], r[7]);
    const R b0 = low2(a0, a2), b1 = low2(a1, a3), b2 = high2(a0, a2), b3 = high2(a1, a3);
    const R b4 = low2(a4, a6), b5 = low2(a5, a7), b6 = high2(a4, a6), b7 = high2(a5, a7);
    return {low4(b0, b4), low4(b1, b5), low4(b2, b6), low4(b3, b7), high4(b0, b4), high4(b1, b5), high4(b2, b6), high4(b3, b7)};
  } else if constexpr (W == 4) {
    const auto low1 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 0, 4, 2, 6); };
    const auto high1 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 1, 5, 3, 7); };
    const auto low2 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 0, 1, 4, 5); };
    const auto high2 = [](R a, R b) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(a, b, 2, 3, 6, 7); };
    const R a0 = low1(r[0], r[1]), a1 = high1(r[0], r[1]), a2 = low1(r[2], r[3]), a3 = high1(r[2], r[3]);
    return {low2(a0, a2), low2(a1, a3), high2(a0, a2), high2(a1, a3)};
  } else {
    static_assert(W == 2);
    return {__builtin_shufflevector(r[0], r[1], 0, 2), __builtin_shufflevector(r[0], r[1], 1, 3)};
  }
}

/// W rows of C numbers each -> C packs; row_of(l): where row l begins.
template <int C, class RowOf>
LINDEN_INLINE void rows_to_lanes(const RowOf& row_of, BodyPack* lanes) {
  for (int at = 0; at < C; at += kBodies) {
    Square square;
    for (int l = 0; l < kBodies; ++l) square[static_cast<std::size_t>(l)] = read(row_of(l) + at);
    square = transposed(square);
    for (int k = 0; k < kBodies && at + k < C; ++k) {
      std::memcpy(&lanes[at + k], &square[static_cast<std::size_t>(k)], sizeof(Register));
    }
  }
}

/// Whole registers are stored: what is too much of a row is overwritten by the next; the last row goes number by number.
template <int C>
LINDEN_INLINE void lanes_to_rows(const BodyPack* lanes, double* rows) {
  for (int at = (C - 1) / kBodies * kBodies; at >= 0; at -= kBodies) {
    Square square{};
    for (int k = 0; k < kBodies && at + k < C; ++k) std::memcpy(&square[static_cast<std::size_t>(k)], &lanes[at + k], sizeof(Register));
    square = transposed(square);
    for (int l = 0; l < kBodies; ++l) {
      const Register& row = square[static_cast<std::size_t>(l)];
      double* const to = rows + l * C + at;
      if (l * C + at + kBodies <= kBodies * C) {
        std::memcpy(to, &row, sizeof row);
      } else {
        for (int k = 0; k < kBodies && at + k < C; ++k) to[k] = row[k];
      }
    }
  }
}

}  // namespace turning

/// Bodies i ... i + W - 1 of one tree.
struct ManyBodies {
  using Scalar = BodyPack;
};
/// Body i, of one tree or of a block of instances.
template <class S>
struct OneBody {
  using Scalar = S;
};

/// action(bodies, i) for bodies begin ... end - 1: as many as a register holds, then one by one.
template <class S, class Action>
LINDEN_INLINE void for_bodies(Index begin, Index end, const Action& action) {
  Index i = begin;
  if constexpr (std::is_same_v<S, double>) {
    for (; i + kBodies <= end; i += kBodies) action(ManyBodies{}, i);
  }
  for (; i < end; ++i) action(OneBody<S>{}, i);
}

/// Whether bodies i ... i + W - 1 are all of one level.
LINDEN_INLINE bool same_level(const Tree& tree, Index i) {
  const Index* const level = tree.level.row(i);
  if (level[0] != level[kBodies - 1]) return false;
  bool same = true;
  for (int l = 1; l < kBodies; ++l) same &= level[l] == level[0];
  return same;
}

/// Whether such bodies are to be found near slot i: not so along a chain or in a humanoid.
LINDEN_INLINE bool is_wide(const Tree& tree, Index i) { return tree.runs[static_cast<std::size_t>(tree.run(i))].widest >= kBodies; }

/// Of slots that hold one kind of joint: many(ManyBodies, i) where a register of them lies on one level, few(part) for what lies between, root to
/// leaves.
template <class Many, class Few>
LINDEN_INLINE void for_same_level_down(const Tree& tree, Slots slots, const Many& many, const Few& few) {
  const auto wide = [&](Index i) LINDEN_INLINE_LAMBDA { return i + kBodies <= slots.end && same_level(tree, i); };
  if (!is_wide(tree, slots.begin)) return few(slots);
  for (Index i = slots.begin; i < slots.end;) {
    if (wide(i)) {
      many(ManyBodies{}, i);
      i += kBodies;
    } else {
      const Index begin = i++;
      while (i < slots.end && !wide(i)) ++i;
      few(slots.part(begin, i));
    }
  }
}

/// The same, leaves to root.
template <class Many, class Few>
LINDEN_INLINE void for_same_level_up(const Tree& tree, Slots slots, const Many& many, const Few& few) {
  const auto wide = [&](Index end) LINDEN_INLINE_LAMBDA { return end - kBodies >= slots.begin && same_level(tree, end - kBodies); };
  if (!is_wide(tree, slots.begin)) return few(slots);
  for (Index i = slots.end; i > slots.begin;) {
    if (wide(i)) {
      i -= kBodies;
      many(ManyBodies{}, i);
    } else {
      const Index end = i--;
      while (i > slots.begin && !wide(i)) --i;
      few(slots.part(i, end));
    }
  }
}

template <template <class> class Value, int Components>
LINDEN_INLINE Value<BodyPack> gather(ManyBodies, const Field<double, Components>& field, Index i) {
  std::array<BodyPack, Components> lanes;
  const double* const rows = field.row(i);
  turning::rows_to_lanes<Components>([&](int l) LINDEN_INLINE_LAMBDA { return rows + l * Components; }, lanes.data());
  return Value<BodyPack>::from(lanes.data());
}
template <template <class> class Value, class S, class Element, int Components>
LINDEN_INLINE Value<S> gather(OneBody<S>, const Field<Element, Components>& field, Index i) {
  return load<Value, S>(field, i);
}

/// Rows at[0], ..., at[W - 1].
template <template <class> class Value, int Components>
LINDEN_INLINE Value<BodyPack> gather_at(ManyBodies, const Field<double, Components>& field, const Index* at) {
  std::array<BodyPack, Components> lanes;
  turning::rows_to_lanes<Components>([&](int l) LINDEN_INLINE_LAMBDA { return field.row(at[l]); }, lanes.data());
  return Value<BodyPack>::from(lanes.data());
}

/// Where the parents of bodies i ... i + W - 1 lie.
LINDEN_INLINE std::array<Index, static_cast<std::size_t>(kBodies)> rows_of_parents(const Tree& tree, Slots slots, Index i) {
  std::array<Index, static_cast<std::size_t>(kBodies)> rows;
  const Index* const parent = tree.parent.row(i);
  for (int l = 0; l < kBodies; ++l) rows[static_cast<std::size_t>(l)] = slots.row_of_parent(parent[l]);
  return rows;
}

template <int Components, class Value>
LINDEN_INLINE void scatter(ManyBodies, Field<double, Components>& field, Index i, const Value& value) {
  std::array<BodyPack, Components> lanes;
  value.to(lanes.data());
  turning::lanes_to_rows<Components>(lanes.data(), field.row(i));
}
template <class S, int Components, class Value>
LINDEN_INLINE void scatter(OneBody<S>, Field<S, Components>& field, Index i, const Value& value) {
  store(field, i, value);
}

/// Consecutive rows of one number each: velocities of a stretch of screws.
LINDEN_INLINE BodyPack gather_row(ManyBodies, const Field<double>& field, Index row) { return BodyPack::load_unaligned(field.row(row)); }
template <class S>
LINDEN_INLINE S gather_row(OneBody<S>, const Field<S>& field, Index row) {
  return field(row);
}
LINDEN_INLINE void scatter_row(ManyBodies, Field<double>& field, Index row, const BodyPack& value) { value.store_unaligned(field.row(row)); }
template <class S>
LINDEN_INLINE void scatter_row(OneBody<S>, Field<S>& field, Index row, const S& value) {
  field(row) = value;
}

/// Numbers of each body, C of Room, as rows `stride` apart: what is beyond C is zero.
template <int C, int Room>
LINDEN_INLINE void store_rows(ManyBodies, const BodyPack* numbers, double* rows, Index stride) {
  static_assert(Room % kBodies == 0);
  for (int at = 0; at < Room; at += kBodies) {
    turning::Square square{};
    for (int k = 0; k < kBodies && at + k < C; ++k) {
      std::memcpy(&square[static_cast<std::size_t>(k)], &numbers[at + k], sizeof(turning::Register));
    }
    square = turning::transposed(square);
    for (int l = 0; l < kBodies; ++l) {
      std::memcpy(rows + l * stride + at, &square[static_cast<std::size_t>(l)], sizeof(turning::Register));
    }
  }
}
template <int C, int Room>
LINDEN_INLINE void store_rows(OneBody<double>, const double* numbers, double* rows, Index) {
  for (int k = 0; k < Room; ++k) rows[k] = k < C ? numbers[k] : 0.0;
}

/// An index of each body, as a number.
LINDEN_INLINE BodyPack at_bodies(ManyBodies, const Field<Index>& field, Index i) {
  std::array<double, static_cast<std::size_t>(kBodies)> numbers;
  for (int l = 0; l < kBodies; ++l) numbers[static_cast<std::size_t>(l)] = field(i + l);
  return BodyPack::load_unaligned(numbers.data());
}

/// Which of the bodies sit on an odd level.
LINDEN_INLINE auto odd_levels(ManyBodies, const Tree& tree, Index i) {
  std::array<double, static_cast<std::size_t>(kBodies)> odd;
  for (int l = 0; l < kBodies; ++l) odd[static_cast<std::size_t>(l)] = tree.level(i + l) % 2;
  return BodyPack::load_unaligned(odd.data()) > BodyPack(0.5);
}
LINDEN_INLINE bool odd_levels(OneBody<double>, const Tree& tree, Index i) { return tree.level(i) % 2 != 0; }

/// To row at[l] of a field the numbers of lane l are added, the last lane first.
template <int Components, class Value>
LINDEN_INLINE void add_at(ManyBodies bodies, Field<double, Components>& field, const Index* at, const Value& value) {
  constexpr int room = (Components + kBodies - 1) / kBodies * kBodies;
  std::array<BodyPack, Components> lanes;
  value.to(lanes.data());
  alignas(kAlignment) double rows[room * kBodies];
  store_rows<Components, room>(bodies, lanes.data(), rows, room);
  for (int l = kBodies - 1; l >= 0; --l) {
    double* const to = field.row(at[l]);
    for (int k = 0; k < Components; ++k) to[k] += rows[l * room + k];
  }
}

/// Least of the bodies.
LINDEN_INLINE double least_of(ManyBodies, const BodyPack& value) {
  std::array<double, static_cast<std::size_t>(kBodies)> numbers;
  value.store_unaligned(numbers.data());
  return std::ranges::min(numbers);
}

/// Sum over the bodies.
LINDEN_INLINE double summed(ManyBodies, const BodyPack& value) { return xsimd::hadd(value); }
template <class S>
LINDEN_INLINE S summed(OneBody<S>, const S& value) {
  return value;
}

}  // namespace linden
