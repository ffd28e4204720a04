// engine/sweeps/tree_kernels.hpp
// The sweeps over one tree of doubles, compiled once, in tree_kernels.cpp and tree_factor_kernels.cpp: whoever steps a tree calls the very
// same instructions as whoever goes by the schedule. Not so those that steps of lanes call for doubles too, compiled for any processor: of
// equal functions the linker takes either.
#pragma once

#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "kernels/tree/rounding_floor_map.hpp"
#include "kernels/tree/velocity_down.hpp"

namespace linden {

using BodyNumbers = BodyConstants<double>;
template <int Components = 1>
using Numbers = Field<double, Components>;

// declared here for those who call, defined where they are compiled
#define LINDEN_TREE_KERNELS(PREFIX)                                                                                                        \
  PREFIX void placement_map(const Tree&, const BodyNumbers&, const Numbers<>&, Slots, Numbers<12>&);                                       \
  PREFIX void motion_map(const Tree&, const BodyNumbers&, const Numbers<>&, Slots, Numbers<7>&);                                           \
  PREFIX void correct_motion_map(const Tree&, const BodyNumbers&, const Numbers<>&, const double&, Slots, Numbers<>&, Numbers<7>&);        \
  PREFIX double displacement_down(const Tree&, const Numbers<12>&, const Numbers<7>&, Slots, Numbers<7>&);                                 \
  PREFIX double momentum_map(const Tree&, const BodyNumbers&, const Numbers<7>&, Slots, Numbers<6>&);                                      \
  PREFIX void momentum_at_end_map(const Tree&, const BodyNumbers&, const Numbers<7>&, const Numbers<6>&, const Numbers<>&, Slots,          \
                                  Numbers<>&);                                                                                             \
  PREFIX void momentum_end_map(const Tree&, const double&, const Numbers<>&, const Numbers<>&, Slots, Numbers<>&);                         \
  PREFIX void momentum_update_map(const Tree&, const BodyNumbers&, const double&, const Numbers<7>&, const Numbers<6>&, const Numbers<>&,  \
                                  const Numbers<>&, Slots, Numbers<>&);                                                                    \
  PREFIX void impulse_up(const Tree&, const BodyNumbers&, const Numbers<12>&, Numbers<6>&, Numbers<>&);                                    \
  PREFIX double residual_up(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<>&, Numbers<6>&, Numbers<>&);               \
  PREFIX double innovation_up(const Tree&, const BodyNumbers&, Slots, Workspace<double>&);                                                 \
  PREFIX double impulse_pass_up(const Tree&, const BodyNumbers&, const Numbers<12>&, const Gains<double>&, const Numbers<>&, Slots,        \
                                Numbers<6>&, Numbers<>&);                                                                                  \
  PREFIX void increment_down<false>(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<7>&, const Gains<double>&,          \
                                    const Numbers<>&, Slots, Numbers<6>&, Numbers<>&);                                                     \
  PREFIX void increment_down<true>(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<7>&, const Gains<double>&,           \
                                   const Numbers<>&, Slots, Numbers<6>&, Numbers<>&);                                                      \
  PREFIX void rate_down(const Tree&, const BodyNumbers&, const Numbers<12>&, const Gains<double>&, const Numbers<>&, Slots, Numbers<6>&,   \
                        Numbers<>&);                                                                                                       \
  PREFIX void advance_map(const Tree&, const Numbers<7>&, const Numbers<>&, Slots, Numbers<>&);                                            \
  PREFIX void gravity_field_down(const Tree&, const Numbers<12>&, const Vec3<double>&, Slots, Numbers<3>&);                                \
  PREFIX void gravity_force_up<false>(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<3>&, Slots, Numbers<3>&,          \
                                      Numbers<>&);                                                                                         \
  PREFIX void velocity_down(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<>&, Numbers<6>&);                           \
  PREFIX void momentum_of_map(const Tree&, const BodyNumbers&, const Numbers<6>&, Numbers<6>&);                                            \
  PREFIX void coriolis_down(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<>&, const Numbers<6>&, Numbers<6>&,         \
                            Numbers<6>&);                                                                                                  \
  PREFIX double rounding_floor_map(const Tree&, const BodyNumbers&, const Numbers<>&, const Numbers<6>&, const Numbers<>&)

// with what effects, or ties between joints, add to the matrix
#define LINDEN_TREE_FACTORS(PREFIX, ADDED)                                                                                                 \
  PREFIX void newton_factor_up(const Tree&, const BodyNumbers&, const Numbers<12>&, const Numbers<7>&, const Numbers<7>&, Slots,           \
                               Numbers<kRowNumbers>&, const Gains<double>&, const ADDED&);                                                 \
  PREFIX void articulated_inertia_up(const Tree&, const BodyNumbers&, const Numbers<12>&, Slots, Numbers<kRowNumbers>&,                    \
                                     const Gains<double>&, const ADDED&)

using JointsAdded = EffectsAdded<double, true, false>;
using BodiesAdded = EffectsAdded<double, false, true>;
using BothAdded = EffectsAdded<double, true, true>;

LINDEN_TREE_KERNELS(extern template);
LINDEN_TREE_FACTORS(extern template, NothingAdded);
LINDEN_TREE_FACTORS(extern template, JointsAdded);
LINDEN_TREE_FACTORS(extern template, BodiesAdded);
LINDEN_TREE_FACTORS(extern template, BothAdded);

}  // namespace linden
