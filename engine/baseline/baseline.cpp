#include "engine/baseline/baseline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "engine/compose/composition.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "kernels/effects/laws.hpp"
#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/velocity_down.hpp"
#include "kernels/tree/world_placement_down.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

Twist<double> bracket(const Twist<double>& u, const Twist<double>& v) {
  return {cross(u.w, v.w), cross(u.w, v.v) + cross(u.v, v.w)};
}

bool finite(const Field<double>& field) {
  return std::ranges::all_of(field.flat(), [](double value) { return std::isfinite(value); });
}

/// to = from + factor x more
void add(const Field<double>& from, double factor, const Field<double>& more, Field<double>& to) {
  for (Index row = 0; row < to.rows(); ++row) to(row) = from(row) + factor * more(row);
}

/// What the effects of joints, or those of bodies, do at an instant. What is sudden has been refused.
template <Site site, class Laws, class Now, class Sum>
void push_all(const Effects& effects, const Now& now, Sum& sum) {
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if constexpr (Entry::facts.site == site) {
      using Law = typename LawFor<Entry, Laws>::type;
      if constexpr (requires(const Entry& entry) { Law::push(entry, now, sum); }) {
        for (const Entry& entry : entries) Law::push(entry, now, sum);
      }
    }
  });
}

}  // namespace

/// Of effects on bodies, which are asked for their potential as within a step.
struct Baseline::BodyEffects {
  explicit BodyEffects(const LawSetup& setup) : laws(laws_of<BodyLaws<double>>(setup)) {}
  BodyLaws<double> laws;
};

std::string_view name(Scheme scheme) { return scheme == Scheme::rk4 ? "RK4" : "semi-implicit Euler"; }

Baseline::Baseline(std::shared_ptr<const Model> model, Scheme scheme, const Options& options, const Effects& effects)
    : model_(std::move(model)),
      scheme_(scheme),
      options_(options),
      gravity_(options.gravity != std::array<double, 3>{0, 0, 0}),
      plan_(std::make_unique<const EffectPlan>(*model_, options, effects)),
      ties_(std::make_unique<MimicTies<double>>(model_->mimics, model_->tree)) {
  check(options);
  if (!model_->couplings.empty()) {
    throw InputError(fmt::format("{} moves trees alone; model {} has a coupling, {}; step it by linden's own method", name(scheme), quoted(model_->names.model),
                                 quoted(model_->couplings.front().name)));
  }
  if (const std::string refused = sudden(effects); !refused.empty()) {
    throw InputError(fmt::format("{} has no forces that change suddenly; the scene has {}", name(scheme), refused));
  }
  const Shape& shape = model_->tree.shape;
  for (Field<double>* field : {&q_, &good_q_}) field->allocate(shape.positions);
  for (Field<double>* field : {&v_, &good_v_, &stage_u_, &stage_v_, &rate_u_, &rate_v_, &sum_u_, &sum_v_})
    field->allocate(shape.velocities);
  work_.allocate(shape);
  if (plan_->bodies) {
    pose_.allocate(shape.slots);
    body_effects_ = std::make_unique<BodyEffects>(plan_->setup(model_->tree));
  }
  std::ranges::copy(model_->neutral(), q_.flat().begin());
}

Baseline::~Baseline() = default;

void Baseline::set(std::span<const double> q, std::span<const double> v) {
  if (q.size() != q_.flat().size() || v.size() != v_.flat().size()) {
    throw InputError(fmt::format("{} positions and {} velocities given for model \"{}\", expected {} and {}", q.size(), v.size(),
                                 model_->names.model, q_.rows(), v_.rows()));
  }
  std::ranges::copy(q, q_.flat().begin());
  std::ranges::copy(v, v_.flat().begin());
  normalise_positions(*model_, q_.flat());
  spread_mimics<double>(ties_->mimics(), v_);
}

void Baseline::place() {
  const Tree& tree = model_->tree;
  placement_map(tree, model_->constants, q_, work_.placement);
  potential_ = 0;
  if (gravity_) {
    const auto& g = options_.gravity;
    gravity_field_down(tree, work_.placement, Vec3<double>{g[0], g[1], g[2]}, work_.field);
    potential_ = gravity_force_up(tree, model_->constants, work_.placement, work_.field, work_.first_moment, work_.force);
  } else {
    std::ranges::fill(work_.force.flat(), 0.0);
  }
  const JointsView<double> at{q_, plan_->q_row, tree};
  Effects::each(plan_->effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if constexpr (Entry::facts.site == Site::joint && Entry::facts.stores) {
      for (const Entry& entry : entries) potential_ += LawFor<Entry, JointLaws<double>>::type::potential(entry, at);
    }
  });
  if (!plan_->bodies) return;
  world_placement_down(tree, work_.placement, pose_);
  each_law(body_effects_->laws, [&]<class Law>(Law& law) {
    if constexpr (Law::facts.stores) potential_ += law.place(pose_);
  });
}

void Baseline::drive_joints(double time, const Field<double>& v) {
  push_all<Site::joint, JointLaws<double>>(plan_->effects, Instant{time, q_, v, plan_->q_row, model_->tree}, work_.force);
}

void Baseline::drive_bodies(double time) {
  if (!plan_->bodies) return;
  push_all<Site::body, BodyLaws<double>>(plan_->effects, BodiesInstant{time, pose_, work_.twist, model_->constants, plan_->effects},
                                         work_.impulse);
}

void Baseline::accelerate(double time, const Field<double>& v, Field<double>& a) {
  const Tree& tree = model_->tree;
  const BodyConstants<double>& constants = model_->constants;
  evaluations_ += 1;
  place();
  drive_joints(time, v);
  velocity_down(tree, constants, work_.placement, v, work_.twist);
  coriolis_down(tree, constants, work_.placement, v, work_.twist, work_.bias, work_.impulse);
  drive_bodies(time);
  impulse_up(tree, constants, work_.placement, work_.impulse, work_.residual);
  for (Index row = 0; row < v.rows(); ++row) work_.residual(row) = work_.force(row) - work_.residual(row);
  fold_mimics(ties_->mimics(), work_.residual);

  const Gains<double> gains{work_.gain_up, work_.gain_down, work_.joint_inverse};
  const auto factor = [&](const auto& added) { articulated_inertia_up(tree, constants, work_.placement, work_.articulated, gains, added); };
  const auto tied = [&](const auto& added) { ties_->empty() ? factor(added) : factor(ties_->held(added)); };
  if (plan_->rotor.rows() > 0) {
    tied(EffectsAdded<double, true, false>{plan_->rotor, none_});
  } else {
    tied(NothingAdded{});
  }
  const auto solve = [&](const Field<double>& r, Field<double>& x) {
    impulse_pass_up(tree, constants, work_.placement, gains, r, work_.bias, work_.innovation);
    rate_down(tree, constants, work_.placement, gains, work_.innovation, work_.variation, x);
  };
  const auto load = [&](Index i) { return tied_load(tree, constants, gains, work_.bias, work_.variation, i); };
  if (!ties_->empty()) ties_->factor(solve, load, work_.increment);
  solve(work_.residual, a);
  if (!ties_->empty()) ties_->complete(a);
}

void Baseline::move(const Field<double>& from, const Field<double>& u) {
  const Tree& tree = model_->tree;
  std::ranges::copy(from.flat(), q_.flat().begin());
  motion_map(tree, model_->constants, u, work_.motion);
  advance_map(tree, work_.motion, u, q_);
  for (const Mimic& mimic : ties_->mimics()) q_(mimic.follower_q) = mimic.multiplier * q_(mimic.leader_q) + mimic.offset;
}

/// u' of exp(u)' = exp(u) v, up to the terms that fourth order needs; a screw's coordinates are its own.
void Baseline::chart_rate(const Field<double>& u, const Field<double>& v, Field<double>& rate) const {
  std::ranges::copy(v.flat(), rate.flat().begin());
  down(model_->tree, [&](auto joint, Index i) {
    if constexpr (joint != JointKind::screw) {
      const Index row = model_->tree.first_v(i);
      const Wrench<double> at = load_joint(joint, u, row), speed = load_joint(joint, v, row);
      const Twist<double> turned{at.n, at.f}, twist{speed.n, speed.f};
      const Twist<double> once = bracket(turned, twist);
      const Twist<double> found = twist + 0.5 * once + (1.0 / 12) * bracket(turned, once);
      store_joint(joint, rate, row, Wrench<double>{found.w, found.v});
    }
  });
}

void Baseline::euler_step() {
  accelerate(time(), v_, rate_v_);
  add(v_, options_.step, rate_v_, v_);
  for (Index row = 0; row < v_.rows(); ++row) stage_u_(row) = options_.step * v_(row);
  move(good_q_, stage_u_);
}

void Baseline::rk4_step() {
  constexpr double node[4] = {0, 0.5, 0.5, 1}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  const double h = options_.step;
  for (int k = 0; k < 4; ++k) {
    if (k == 0) {
      accelerate(time(), v_, rate_v_);
      std::ranges::copy(v_.flat(), rate_u_.flat().begin());
    } else {
      for (Index row = 0; row < v_.rows(); ++row) stage_u_(row) = h * node[k] * rate_u_(row);
      add(v_, h * node[k], rate_v_, stage_v_);
      move(good_q_, stage_u_);
      chart_rate(stage_u_, stage_v_, rate_u_);
      accelerate(time() + h * node[k], stage_v_, rate_v_);
    }
    for (Index row = 0; row < v_.rows(); ++row) {
      sum_u_(row) = (k == 0 ? 0 : sum_u_(row)) + h * weight[k] * rate_u_(row);
      sum_v_(row) = (k == 0 ? 0 : sum_v_(row)) + h * weight[k] * rate_v_(row);
    }
  }
  add(v_, 1, sum_v_, v_);
  move(good_q_, sum_u_);
}

bool Baseline::step() {
  std::ranges::copy(q_.flat(), good_q_.flat().begin());
  std::ranges::copy(v_.flat(), good_v_.flat().begin());
  if (scheme_ == Scheme::rk4) {
    rk4_step();
  } else {
    euler_step();
  }
  if (finite(q_) && finite(v_)) {
    steps_ += 1;
    return true;
  }
  std::ranges::copy(good_q_.flat(), q_.flat().begin());
  std::ranges::copy(good_v_.flat(), v_.flat().begin());
  return false;
}

void Baseline::find_momentum(const Field<double>& v) {
  const Tree& tree = model_->tree;
  place();
  velocity_down(tree, model_->constants, work_.placement, v, work_.twist);
  momentum_of_map(tree, model_->constants, work_.twist, work_.impulse);
  impulse_up(tree, model_->constants, work_.placement, work_.impulse, work_.residual);
  add_armature<double>(plan_->effects.armature, v, work_.residual);
}

Energy Baseline::energy() {
  find_momentum(v_);
  double kinetic = 0;
  for (Index row = 0; row < v_.rows(); ++row) kinetic += 0.5 * v_(row) * work_.residual(row);
  return {kinetic, potential_};
}

Momentum Baseline::momentum() {
  find_momentum(v_);
  const auto h = load<Wrench, double>(work_.impulse, 0);
  return {{h.n.x, h.n.y, h.n.z}, {h.f.x, h.f.y, h.f.z}};
}

}  // namespace linden
