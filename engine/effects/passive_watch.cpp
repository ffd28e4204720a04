#include "engine/effects/passive_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "layout/effects.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// What effects took in a step, where those that strike share: what one gave is made good by what others took, as long as they took that much.
std::array<double, kEffectLists> shared_losses(const EffectWork& work) {
  std::array<double, kEffectLists> losses = work.each;
  double gave = 0, took = 0;
  for (std::size_t k = 0; k < kEffectLists; ++k) {
    if (!kEffectFacts[k]->strikes) continue;
    gave += std::max(-losses[k], 0.0);
    took += std::max(losses[k], 0.0);
  }
  if (gave == 0 || took == 0) return losses;
  const double shared = std::min(gave, took);
  for (std::size_t k = 0; k < kEffectLists; ++k) {
    if (kEffectFacts[k]->strikes) losses[k] -= shared * (losses[k] > 0 ? losses[k] / took : losses[k] / gave);
  }
  return losses;
}

}  // namespace

PassiveWatch::PassiveWatch(const Model& model, const Effects& effects)
    : model_(model), still_air_(effects.wind == std::array<double, 3>{0, 0, 0}) {}

void PassiveWatch::add(const EffectAccount& step, double time) {
  known_.done += step.work.magnitude();
  known_.scale = std::max({known_.scale, step.kinetic, known_.done});
  EffectWork work = step.work;
  double& contact = work.of<PairContact>();
  const double may_give = known_.owed + step.freed, freed = std::clamp(-contact, 0.0, may_give);
  contact += freed;
  known_.owed = std::min(may_give - freed, step.freed);
  const std::array<double, kEffectLists> losses = shared_losses(work);
  for (std::size_t k = 0; k < kEffectLists; ++k) {
    const EffectFacts& facts = *kEffectFacts[k];
    if (facts.account != Account::taken || (k == kListOf<Drag> && !still_air_)) continue;
    Watched& watched = known_.watched[k];
    watched.taken += losses[k];
    watched.most = std::max(watched.most, watched.taken);
    const double gift = watched.most - watched.taken;
    if (!(gift > kGift * known_.scale)) continue;
    if (watched.gift < 0) {
      const LeastLoss& least = step.least[k];
      const bool on_joints = facts.site == Site::joint;
      const auto& names = on_joints ? model_.names.velocity : model_.names.body;
      std::string where = "no place of its own";
      if (least.at >= 0) where = fmt::format("{} {}", on_joints ? "joint" : "body", quoted(names[static_cast<std::size_t>(least.at)]));
      watched.gift = static_cast<int>(known_.gifts.size());
      known_.gifts.push_back({std::string(facts.name), where, time, gift});
    }
    PassiveGift& told = known_.gifts[static_cast<std::size_t>(watched.gift)];
    told.amount = std::max(told.amount, gift);
  }
}

std::string describe(const PassiveGift& gift) {
  return fmt::format("effects.{} gave {:.3g} J, which it can only take, first at {:.6g} s and most at {}: the motion is not to be trusted from there on",
                     gift.effect, gift.amount, gift.time, gift.where);
}

}  // namespace linden
