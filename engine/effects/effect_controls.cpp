#include "engine/effects/effect_controls.hpp"

#include "engine/effects/effect_sweeps.hpp"

namespace linden {

std::span<double> EffectControls::servo_targets() const {
  return effects_ != nullptr ? effects_->servo_targets().flat() : std::span<double>();
}

std::span<double> EffectControls::friction_forces() const {
  return effects_ != nullptr ? effects_->friction_forces().flat() : std::span<double>();
}

double EffectControls::gain(Index k) const { return effects_ != nullptr ? effects_->gains()(k) : 1; }

void EffectControls::set_gain(Index k, double factor) const {
  if (effects_ != nullptr) effects_->set_gain(k, factor);
}

double EffectControls::ground_friction() const { return effects_ != nullptr ? effects_->ground_friction() : 0; }

void EffectControls::set_ground_friction(double coefficient) const {
  if (effects_ != nullptr) effects_->ground_friction() = coefficient;
}

EffectControls::Reading EffectControls::reading() const {
  if (effects_ == nullptr) return {};
  return {effects_->excess_before().flat(), effects_->reading().flat(), effects_->bend().flat()};
}

double EffectControls::kept(Index k) const { return effects_ != nullptr ? effects_->kept(k) : 0; }

void EffectControls::set_kept(Index k, double number) const {
  if (effects_ != nullptr) effects_->set_kept(k, number);
}

std::vector<std::span<double>> EffectControls::memory() const {
  if (effects_ == nullptr) return {};
  const auto memory = effects_->memory();
  return {memory.begin(), memory.end()};
}

}  // namespace linden
