// engine/queries/observation_schedule.hpp
// What a list of observations comes to: which bodies have to be followed how far, and what is then looked at, in order. Plain data, the
// same for one state and for blocks of them; the lanes that go by it are in engine/queries/lane_observer.hpp.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/effects/ground_plan.hpp"
#include "kernels/queries/body_motion_down.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

enum class Look : std::uint8_t {
  positions, velocities, accelerations, momenta, targets, time, energy,         // rows as they are
  centre_of_mass, centre_of_mass_velocity, momentum,                            // of all bodies
  pose, position, quaternion, twist, acceleration, imu, contact,                // of a link
};

/// One entry of a row.
struct ScheduledLook {
  Look what;
  Index offset = 0;            // in the row
  Index first = 0, count = 0;  // of the rows looked at
  LinkPlace link{};
};

struct ObservationSchedule {
  std::uint64_t model_hash = 0;
  std::size_t servos = 0;
  Index width = 0;
  std::vector<ScheduledLook> looks;

  // what has to be known of a state
  bool velocities = false, accelerations = false, targets = false, time = false, energy = false;
  bool follows = false;                     // any body at all
  MotionDepth depth = MotionDepth::poses;   // and how far
  std::vector<Index> slots;                 // these bodies, in order
  bool totals = false, momenta = false;     // sums over all bodies
  GroundPlan ground;                        // points of the bodies asked for; none where no contact is
  struct Load {
    Index slot;
    std::size_t number;  // of what contacts remember, the first of two (remembered_load in engine/sweeps/body_contacts.hpp)
  };
  std::vector<Load> loads;                  // of shapes of the bodies asked for that other bodies may touch
};

}  // namespace linden
