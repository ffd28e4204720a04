#include "engine/sweeps/effect_schedule.hpp"

#include <algorithm>
#include <array>

#include "engine/effects/effect_sweeps.hpp"
#include "engine/sweeps/step_memory.hpp"
#include "kernels/tree/motion_map.hpp"

namespace linden {
namespace {

/// A part of a law of joints, in a step that was set out.
template <class Law>
void run_joint_part(StepMemory& memory, Part part) {
  EffectSweeps<double>& effects = *memory.effects;
  Law& law = std::get<Law>(effects.parts().joint_laws);
  const StepView<double> view = effects.view();
  Workspace<double>& work = memory.work;
  if (part == Part::begin) {
    const LaneTimes<double> times{memory.time};
    law.begin(view, StepStart<double>{times, memory.options.step, memory.before, memory.is_known(), false}, work.delta);
  }
  if (part == Part::add) law.add(view, effects.parts().joints);
  if (part == Part::evaluate) law.evaluate(view, work.motion, work.momentum_target);
  if constexpr (Law::facts.has_states) {
    if (part == Part::update_states) {
      memory.changed |= law.update_states(view, memory.update, 0.0, memory.joint_residual(), work.delta);
    }
  }
}

/// And of a law of bodies.
template <class Law>
void run_body_part(StepMemory& memory, Part part) {
  EffectSweeps<double>& effects = *memory.effects;
  Law& law = std::get<Law>(effects.parts().body_laws);
  Workspace<double>& work = memory.work;
  BodyImpulses<double>& sum = effects.parts().bodies;
  if constexpr (Law::facts.stores) {
    if (part == Part::place) law.place(sum.pose);
  }
  if (part == Part::begin) {
    const LaneTimes<double> times{memory.time};
    law.begin(StepStart<double>{times, memory.options.step, memory.before, memory.is_known(), false});
  }
  if constexpr (requires { law.guess(0.0, work.displacement); }) {
    if (part == Part::guess && memory.is_first) law.guess(memory.options.step, work.displacement);
  }
  if (part == Part::add) {
    for (const LoadedBody& body : memory.plan.loaded_bodies) {
      const auto& [first, last] = body.ranges[kPlaceOf<Law, BodyLaws<double>>];
      if (first < last) law.add(effects.view(), memory.constants, first, last, work.displacement, sum, work.impulse);
    }
  }
  if constexpr (Law::facts.has_states) {
    if (part == Part::update_states) {
      memory.changed |= law.update_states(effects.view(), memory.update, 0.0, memory.joint_residual(), work.delta);
    }
  }
  if (part == Part::keep) law.keep();
}

void add_part(ScheduleDraft& draft, When when, const PartSweep& sweep, void (*run)(StepMemory&, Part)) {
  std::string reads(sweep.reads);
  constexpr std::string_view residual = "residual";
  if (reads.starts_with(residual)) reads.replace(0, residual.size(), draft.joint_residual());
  draft.add(when, sweep.name, reads, sweep.writes, [run, part = sweep.part](StepMemory& memory, Slots) { run(memory, part); });
}

/// Sweeps of the laws that have anything to do, as far as they are this part.
void add_parts(ScheduleDraft& draft, Part part, Site site, When when) {
  const LawSetup setup = draft.plan.setup(draft.model.tree);
  const auto add = [&]<class Law>(bool acts, bool settling, auto run) {
    for (const PartSweep& sweep : Law::sweeps) {
      if (sweep.part == part && acts && (part != Part::update_states || settling)) add_part(draft, when, sweep, run);
    }
  };
  if (site == Site::joint) {
    each_law_type<JointLaws<double>>([&]<class Law>() {
      const auto& entries = draft.plan.effects.list<typename Law::Entry>();
      add.template operator()<Law>(!entries.empty(), std::ranges::any_of(entries, settles<typename Law::Entry>), run_joint_part<Law>);
    });
  } else {
    each_law_type<BodyLaws<double>>([&]<class Law>() {
      add.template operator()<Law>(!Law::touching(setup).empty(), Law::facts.has_states, run_body_part<Law>);
    });
  }
}

/// Rows of all joint effects in their states.
void add_rows(ScheduleDraft& draft, When when) {
  if (!draft.plan.joints) return;
  draft.add(when, "clear_rows", "", "joint impulses", [](StepMemory& memory, Slots) { clear(memory.effects->parts().joints); });
  add_parts(draft, Part::add, Site::joint, when);
}

}  // namespace

void add_arrival_of_effects(ScheduleDraft& draft) {
  if (!draft.plan.bodies) return;
  draft.add(When::arrival, "world_placement_down", "placement", "pose", [](StepMemory& memory, Slots) {
    world_placement_down(memory.model.tree, memory.work.placement, memory.effects->parts().bodies.pose);
  });
  add_parts(draft, Part::place, Site::body, When::arrival);
}

void add_beginning_of_effects(ScheduleDraft& draft) {
  if (draft.plan.joints) {
    draft.add(When::first, "keep_target", "momentum_target", "joint impulses", [](StepMemory& memory, Slots) {
      std::ranges::copy(memory.work.momentum_target.flat(), memory.effects->plain_target().flat().begin());
    });
  }
  add_parts(draft, Part::begin, Site::body, When::first);
  add_parts(draft, Part::begin, Site::joint, When::first);
  add_rows(draft, When::first);
}

void add_action_of_effects(ScheduleDraft& draft) {
  const EffectPlan& plan = draft.plan;
  if (plan.bodies) {
    add_parts(draft, Part::guess, Site::body, When::evaluation);
    draft.add(When::evaluation, "clear_bodies", "", "body impulses", [](StepMemory& memory, Slots) {
      for (const LoadedBody& body : memory.plan.loaded_bodies) clear_body(memory.effects->parts().bodies, body.slot);
    });
    add_parts(draft, Part::add, Site::body, When::evaluation);
  }
  if (!plan.joints) return;
  if (plan.balls) {
    draft.add(When::evaluation, "displacement_map", "motion", "delta",
              [](StepMemory& memory, Slots) { displacement_map(memory.model.tree, memory.work.motion, memory.work.delta); });
  }
  draft.add(When::evaluation, "joint_impulses_map", "joint impulses, delta", "momentum_target", [](StepMemory& memory, Slots) {
    joint_impulses_map(memory.effects->joint_sum(), memory.work.delta, memory.work.momentum_target);
  });
  add_parts(draft, Part::evaluate, Site::joint, When::evaluation);
  if (!plan.effects.armature.empty()) {
    draft.add(When::evaluation, "armature_energy", "armature, delta", "", [](StepMemory& memory, Slots) {
      memory.now.energy += armature_energy<double>(memory.plan.effects.armature, memory.work.delta);
    });
  }
}

void add_states_of_effects(ScheduleDraft& draft) {
  if (!draft.plan.has_states) return;
  const std::size_t none = draft.sweeps.size();
  add_parts(draft, Part::update_states, Site::joint, When::states);
  if (draft.sweeps.size() > none) add_rows(draft, When::states);
  add_parts(draft, Part::update_states, Site::body, When::states);
}

void add_end_of_effects(ScheduleDraft& draft) {
  const std::string residual(draft.joint_residual());
  if (draft.plan.joints) {
    draft.add(When::last, "joint_impulses_end_map", "joint impulses, delta, motion, q, " + residual, "end_impulse, " + residual,
              [](StepMemory& memory, Slots) {
                memory.effects->end_joints(memory.work.delta, memory.work.motion, Stopped::struck, memory.joint_residual(),
                                            memory.work.end_impulse);
              });
  }
  if (!draft.plan.bodies) return;
  Sweep& ends = draft.add(When::last, "add_given_up", "placement, displacement, body impulses, impulse", "body impulses, impulse",
                          [](StepMemory& memory, Slots) {
                            memory.effects->add_ends(memory.work.placement, memory.work.displacement, memory.work.impulse);
                          });
  ends.sums = true;
  add_parts(draft, Part::keep, Site::body, When::last);
}

void add_impulses_of_effects(ScheduleDraft& draft) {
  if (!draft.plan.joints) return;
  draft.add(When::last, "add_end_impulse", "p, end_impulse", "p", [](StepMemory& memory, Slots) {
    for (Index row = 0; row < memory.state.p.rows(); ++row) memory.state.p(row) += memory.work.end_impulse(row);
  });
}

void add_reading_of_effects(ScheduleDraft& draft) {
  if (!draft.plan.any()) return;
  if (draft.options.order != 2) {
    draft.add(When::last, "keep_displacement", "delta", "before",
              [](StepMemory& memory, Slots) { std::ranges::copy(memory.work.delta.flat(), memory.before.flat().begin()); });
  }
  draft.add(When::last, "end_reading", "screw, placement, delta, before, body impulses, reading",
            draft.plan.bodies ? "impulse, increment, reading" : "reading", [](StepMemory& memory, Slots) {
    Workspace<double>& work = memory.work;
    const bool known = memory.options.order == 2 && memory.is_known();
    memory.effects->end_reading(memory.constants, work.placement, true, work.delta, memory.before, known, work.impulse, work.increment);
  });
}

}  // namespace linden
