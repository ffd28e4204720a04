// engine/effects/revision.hpp
// How far a solve is when the states of effects - sticks, slides, at a limit - are looked at.
#pragma once

namespace linden {

/// In which instances: the residual is small; it is solved; states have been updated so often that of what sticks too hard one alone begins
/// to slide; and so often that of limits too one alone changes.
template <class Mask>
struct Revision {
  Mask near, solved, late, last;
};

}  // namespace linden
