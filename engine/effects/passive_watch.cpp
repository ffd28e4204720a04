#include "engine/effects/passive_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/effects.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

struct Passive {
  const char* name;
  double EffectWork::*loss;
  LeastLoss EffectAccount::*least;
  bool on_joints;
};

constexpr std::array<Passive, 5> kPassive{{
    {"damping", &EffectWork::damping, &EffectAccount::damping, true},
    {"friction", &EffectWork::friction, &EffectAccount::friction, true},
    {"limits", &EffectWork::limits, &EffectAccount::limits, true},
    {"drag", &EffectWork::drag, &EffectAccount::drag, false},
    {"ground", &EffectWork::ground, &EffectAccount::ground, false},
}};

}  // namespace

PassiveWatch::PassiveWatch(const Model& model, const Effects& effects)
    : model_(model), still_air_(effects.wind == std::array<double, 3>{0, 0, 0}) {}

void PassiveWatch::add(const EffectAccount& step, double time) {
  done_ += step.work.magnitude();
  scale_ = std::max({scale_, step.kinetic, done_});
  for (std::size_t k = 0; k < kPassive.size(); ++k) {
    const Passive& passive = kPassive[k];
    if (passive.loss == &EffectWork::drag && !still_air_) continue;
    Watched& watched = watched_[k];
    watched.taken += step.work.*passive.loss;
    watched.most = std::max(watched.most, watched.taken);
    const double gift = watched.most - watched.taken;
    if (!(gift > kGift * scale_)) continue;
    if (watched.gift < 0) {
      const LeastLoss& least = step.*passive.least;
      const auto& names = passive.on_joints ? model_.names.velocity : model_.names.body;
      watched.gift = static_cast<int>(gifts_.size());
      gifts_.push_back({passive.name,
                        least.at < 0 ? std::string("no place of its own")
                                     : fmt::format("{} {}", passive.on_joints ? "joint" : "body", quoted(names[static_cast<std::size_t>(least.at)])),
                        time, gift});
    }
    PassiveGift& told = gifts_[static_cast<std::size_t>(watched.gift)];
    told.amount = std::max(told.amount, gift);
  }
}

std::string describe(const PassiveGift& gift) {
  return fmt::format("effects.{} gave {:.3g} J, which it can only take, first at {:.6g} s and most at {}: the motion is not to be trusted from there on",
                     gift.effect, gift.amount, gift.time, gift.where);
}

}  // namespace linden
