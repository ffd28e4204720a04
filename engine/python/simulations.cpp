// engine/python/simulations.cpp
// One instance in time (engine/simulation.hpp).
#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/python/patience.hpp"
#include "engine/queries/energy_by_effect.hpp"
#include "layout/support/input_error.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

StepReport step(PySimulation& self) {
  Simulation& simulation = self.to_change();
  StepReport report;
  {
    const InUse::Hold hold(self.in_use());
    const nb::gil_scoped_release release;
    report = simulation.step();
  }
  if (!report.ok()) raise_step_error(simulation.describe(report), nb::cast(report));
  return report;
}

constexpr double kBodiesASecond = 1e5;  // or more

StepsReport run(PySimulation& self, std::int64_t steps) {
  if (steps < 0) throw InputError("steps: " + std::to_string(steps) + " are asked for; expected zero or more");
  Simulation& simulation = self.to_change();
  const InUse::Hold hold(self.in_use());
  StepsReport total;
  const auto first = static_cast<std::int64_t>(kPart * kBodiesASecond / simulation.model().tree.bodies());
  in_parts(steps, first, [&](std::int64_t part) {
    const StepsReport report = simulation.run(part);
    total.add(report);
    return report.ok();
  });
  if (!total.ok()) raise_step_error(simulation.describe(total.last), nb::cast(total));
  return total;
}

StepsReport advance_to(PySimulation& self, double t) {
  Simulation& simulation = self.to_change();
  const InUse::Hold hold(self.in_use());
  if (!std::isfinite(t)) return simulation.advance_to(t);  // which refuses it
  StepsReport total;
  const auto first = static_cast<std::int64_t>(kPart * kBodiesASecond / simulation.model().tree.bodies());
  in_parts(std::numeric_limits<std::int64_t>::max(), first, [&](std::int64_t part) {
    // so many steps, about: the motion is the same wherever it is stopped
    const StepsReport report = simulation.advance_to(std::min(t, simulation.time() + static_cast<double>(part) * simulation.last_step()));
    total.add(report);
    return report.ok() && report.steps > 0;
  });
  if (!total.ok()) raise_step_error(simulation.describe(total.last), nb::cast(total));
  return total;
}

void set_forces(PySimulation& self, nb::handle value) {
  if (value.is_none()) return self.change([](Simulation& simulation) { simulation.set_forces({}); });
  const Numbers forces(value, "forces", {self.look().model().tree.shape.velocities});
  self.change([&](Simulation& simulation) { simulation.set_forces(forces); });
}

/// [nv], of none too.
std::vector<double> forces_of(Simulation& simulation) {
  std::vector<double> now(simulation.forces().begin(), simulation.forces().end());
  now.resize(static_cast<std::size_t>(simulation.model().tree.shape.velocities));
  return now;
}

Index servo_count(PySimulation& self) { return static_cast<Index>(self.look().effects().servos.size()); }

nb::typed<nb::dict, nb::str, double> energies(PySimulation& self) {
  nb::dict shares;
  for (const EnergyShare& share : self.ask([](Simulation& simulation) { return energy_by_effect(simulation); }))
    shares[share.name.c_str()] = share.energy;
  return shares;
}

/// A place where the ground pushes, or a body, with names.
struct Contact {
  std::string body, other;
  ContactPoint point;
};

std::vector<Contact> contacts(PySimulation& self) {
  std::vector<Contact> found;
  const Names& names = self.look().model().names;
  for (const ContactPoint& point : self.ask([](Simulation& simulation) { return simulation.contact_points(); })) {
    const std::string& other = point.other == 0 ? point.other_link : names.body[static_cast<std::size_t>(point.other)];
    found.push_back({names.body[static_cast<std::size_t>(point.slot)], other, point});
  }
  return found;
}

/// One joint of a simulation: its rows of q and v.
class PyJoint {
 public:
  PyJoint(PySimulation& simulation, const std::string& name) : simulation_(simulation) {
    const Model& model = simulation.look().model();
    row_ = row_of(model, name);
    slot_ = 1;
    while (model.tree.first_v(slot_) != row_) ++slot_;
    const JointKind kind = model.tree.kind(slot_);
    nq_ = position_count(kind);
    nv_ = velocity_count(kind);
    first_q_ = model.tree.first_q(slot_);
  }

  std::string name() const { return model().names.joint[static_cast<std::size_t>(slot_)]; }
  nb::any q() const { return part_of(simulation_.look().positions(), first_q_, nq_); }
  nb::any v() const {
    return part_of(simulation_.ask([](Simulation& simulation) { return simulation.velocities(); }), row_, nv_);
  }
  nb::any force() const { return part_of(forces_of(simulation_.look()), row_, nv_); }
  void set_q(nb::handle value) {
    const std::span<const double> now = simulation_.look().positions();
    std::vector<double> q(now.begin(), now.end());
    put(value, "q", q, first_q_, nq_);
    simulation_.change([&](Simulation& simulation) { simulation.set_positions(q); });
  }
  void set_v(nb::handle value) {
    std::vector<double> v = simulation_.ask([](Simulation& simulation) { return simulation.velocities(); });
    put(value, "v", v, row_, nv_);
    simulation_.change([&](Simulation& simulation) { simulation.set_velocities(v); });
  }
  void set_force(nb::handle value) {
    std::vector<double> forces = forces_of(simulation_.look());
    put(value, "force", forces, row_, nv_);
    simulation_.change([&](Simulation& simulation) { simulation.set_forces(forces); });
  }
  double target() const { return simulation_.look().servo_targets()[servo()]; }
  void set_target(double value) {
    std::vector<double> targets = simulation_.look().servo_targets();
    targets[servo()] = value;
    simulation_.change([&](Simulation& simulation) { simulation.set_servo_targets(targets); });
  }
  double torque() const { return simulation_.look().servo_torques()[servo()]; }
  double lower() const { return model().attributes.lower(row_); }
  double upper() const { return model().attributes.upper(row_); }
  double max_effort() const { return model().attributes.max_effort(row_); }
  double max_velocity() const { return model().attributes.max_velocity(row_); }
  nb::slice q_rows() const { return {first_q_, first_q_ + nq_, 1}; }
  nb::slice v_rows() const { return {row_, row_ + nv_, 1}; }

 private:
  const Model& model() const { return simulation_.look().model(); }
  /// A number of a joint with one, else an array.
  static nb::any part_of(std::span<const double> rows, Index first, Index count) {
    const std::span<const double> part = rows.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count));
    if (count == 1) return nb::borrow<nb::any>(nb::float_(part[0]));
    return nb::borrow<nb::any>(nb::cast(fixed_array(part)));
  }
  static void put(nb::handle value, const char* what, std::vector<double>& rows, Index first, Index count) {
    const Numbers given = count == 1 ? Numbers(value, what, {}) : Numbers(value, what, {count});
    std::ranges::copy(std::span<const double>(given), rows.begin() + first);
  }
  std::size_t servo() const {
    const std::vector<Servo>& servos = simulation_.look().effects().servos;
    const auto found = std::ranges::find(servos, row_, &Servo::row);
    if (found == servos.end()) throw InputError("joint \"" + name() + "\": no servo drives it; expected one among the effects");
    return static_cast<std::size_t>(found - servos.begin());
  }

  PySimulation& simulation_;
  Index slot_, row_, first_q_, nq_, nv_;
};

void bind_joint(nb::module_& m) {
  nb::class_<PyJoint>(m, "Joint", "One joint of a simulation. What it has one number of is a float, else an array.")
      .def_prop_ro("name", &PyJoint::name)
      .def_prop_rw("q", &PyJoint::q, &PyJoint::set_q,
                   "Position [rad, m]; of a ball joint a quaternion x y z w, of a floating one position, quaternion.")
      .def_prop_rw("v", &PyJoint::v, &PyJoint::set_v,
                   "Velocity [rad/s, m/s]; of a ball or floating joint angular, then linear, in the body's frame.")
      .def_prop_rw("force", &PyJoint::force, &PyJoint::set_force, "Force that is applied to it over every step [N m, N].")
      .def_prop_rw("target", &PyJoint::target, &PyJoint::set_target, "Where its servo drives it [rad, m].")
      .def_prop_ro("torque", &PyJoint::torque, "Of its servo, mean over the last step [N m, N]; needs keep_forces before that step.")
      .def_prop_ro("lower", &PyJoint::lower, "Limits as the robot's file has them [rad, m].")
      .def_prop_ro("upper", &PyJoint::upper)
      .def_prop_ro("max_effort", &PyJoint::max_effort, "[N m, N]")
      .def_prop_ro("max_velocity", &PyJoint::max_velocity, "[rad/s, m/s]")
      .def_prop_ro("q_rows", &PyJoint::q_rows, "Its part of q.")
      .def_prop_ro("v_rows", &PyJoint::v_rows, "Its part of v.");
}

void bind_contact(nb::module_& m) {
  const auto three = [](const std::array<double, 3>& numbers) { return fixed_array(std::span<const double>(numbers)); };
  nb::class_<Contact>(m, "Contact", "Where the ground pushes a body, or another body does, in the step taken last; world frame.")
      .def_ro("body", &Contact::body, "That is pushed.")
      .def_ro("other", &Contact::other, "Body that pushes, or the link that is fixed to the world, world/table; empty: the ground.")
      .def_prop_ro(
          "place", [three](const Contact& self) { return three(self.point.place); }, "Where they touch [3; m].")
      .def_prop_ro(
          "normal", [three](const Contact& self) { return three(self.point.normal); }, "Of what pushes there, towards the body, of unit length [3].")
      .def_prop_ro(
          "force", [three](const Contact& self) { return three(self.point.force); },
          "On the body, friction with it, mean over the step [3; N].")
      .def_prop_ro(
          "moment", [three](const Contact& self) { return three(self.point.moment); },
          "Likewise, against rolling and spinning, beside that of the force at its place [3; N m].")
      .def("__repr__", [](const Contact& self) {
        const auto& p = self.point.place;
        const auto& f = self.point.force;
        return fmt::format("Contact(\"{}\" at [{:.4g}, {:.4g}, {:.4g}], force [{:.4g}, {:.4g}, {:.4g}])", self.body, p[0], p[1], p[2], f[0],
                           f[1], f[2]);
      });
}

void bind_coupling(nb::module_& m) {
  nb::class_<CouplingState>(m, "Coupling", "How far open a coupling is, and what held it in the step taken last, row by row.")
      .def_ro("name", &CouplingState::name)
      .def_prop_ro(
          "gaps", [](const CouplingState& self) { return fixed_array(std::span<const double>(self.gaps)); },
          "Where the bodies are now [rows; m, or cosine of an angle; of a bushing rad; of a gear as its coordinates]. Of what gives way, how far it is stretched.")
      .def_prop_ro(
          "forces", [](const CouplingState& self) { return fixed_array(std::span<const double>(self.forces)); },
          "Over the step taken last [rows; N, N m]: of a shift along its axis of the first link, on the second.")
      .def_prop_ro(
          "held_already",
          [](const CouplingState& self) {
            nb::typed<nb::list, bool> rows;
            for (const bool held : self.redundant) rows.append(held);
            return rows;
          },
          "Rows that other rows hold: their force is zero.")
      .def("__repr__", [](const CouplingState& self) { return fmt::format("Coupling(\"{}\", {} rows)", self.name, self.gaps.size()); });
}

/// What it is, and what is asked of its state.
void bind_state(nb::class_<PySimulation>& c) {
  c.def_prop_ro("scene", &PySimulation::scene)
      .def_prop_ro(
          "model", [](PySimulation& self) -> const Model& { return self.look().model(); }, nb::rv_policy::reference_internal,
          "With the masses that its scene's seed drew, where it randomises them.")
      .def_prop_ro(
          "time", [](PySimulation& self) { return self.look().time(); }, "[s]")
      .def_prop_ro(
          "steps", [](PySimulation& self) { return self.look().steps(); }, "Taken since the start.")
      .def_prop_ro(
          "last_step", [](PySimulation& self) { return self.look().last_step(); }, "Length of the step taken last, or of the first to come [s].")
      .def_prop_ro(
          "step_lengths", [](PySimulation& self) { return self.look().step_lengths(); },
          "How long steps were and what became of the accuracy asked for; None where steps do not vary.")
      .def_prop_rw(
          "q", [](PySimulation& self) { return fixed_array(self.look().positions()); },
          [](PySimulation& self, nb::handle value) {
            const Numbers q(value, "q", {self.look().model().tree.shape.positions});
            self.change([&](Simulation& simulation) { simulation.set_positions(q); });
          },
          "Positions [nq], as they are now: an array that does not change. Assigning keeps the velocities; quaternions are normalised and "
          "mimic joints follow their leaders.")
      .def_prop_rw(
          "v", [](PySimulation& self) { return fixed_array(self.ask([](Simulation& simulation) { return simulation.velocities(); })); },
          [](PySimulation& self, nb::handle value) {
            const Numbers v(value, "v", {self.look().model().tree.shape.velocities});
            self.change([&](Simulation& simulation) { simulation.set_velocities(v); });
          },
          "Velocities of the motion [nv; rad/s, m/s], likewise; of ball and floating joints angular, then linear, in the body's frame.")
      .def_prop_ro(
          "p", [](PySimulation& self) { return fixed_array(self.look().momenta()); }, "Discrete momenta [nv].")
      .def_prop_ro(
          "a", [](PySimulation& self) { return fixed_array(self.look().accelerations()); },
          "Accelerations of the motion [nv]: what the mean velocities of the last two steps differ by, over the step.")
      .def_prop_ro(
          "energy", [](PySimulation& self) { return self.ask([](Simulation& simulation) { return simulation.energy(); }); },
          "Of the whole system now.")
      .def_prop_ro("energies", &energies,
                   "Energies that there are in the scene and what each of its effects took or gave since the start, by name [J]: the sum "
                   "of the first "
                   "kind, plus what was taken, less what was given, stays.")
      .def_prop_ro(
          "momentum", [](PySimulation& self) { return self.ask([](Simulation& simulation) { return simulation.momentum(); }); },
          "Of the whole system about the world's origin.")
      .def_prop_ro(
          "passive_gifts",
          [](PySimulation& self) {
            std::vector<std::string> texts;
            for (const PassiveGift& gift : self.look().passive_gifts()) texts.push_back(describe(gift));
            return texts;
          },
          "A sentence for each effect that gave energy although it can only take it: none where all is well.")
      .def(
          "kinematics", [](PySimulation& self) { return Kinematics(*self.kinematics()); }, nb::keep_alive<0, 1>(),
          "The state as it is now, to be asked; it does not change as the simulation goes on.")
      .def_prop_ro("_kinematics", &PySimulation::kinematics)
      .def(
          "joint", [](PySimulation& self, const std::string& name) { return PyJoint(self, name); }, "name"_a, nb::keep_alive<0, 1>(),
          "A joint by its name, to read and to set. An unknown one is an InputError with the nearest name.");
}

/// What acts on it, to be set.
void bind_controls(nb::class_<PySimulation>& c) {
  c.def_prop_rw(
       "forces", [](PySimulation& self) { return fixed_array(forces_of(self.look())); }, &set_forces,
       "Generalized forces on top of all that acts [nv; N m, N], the same over every step until they are set anew; None: none.",
       nb::for_setter(nb::arg().none()))
      .def_prop_rw(
          "targets", [](PySimulation& self) { return fixed_array(self.look().servo_targets()); },
          [](PySimulation& self, nb::handle value) {
            const Numbers targets(value, "targets", {servo_count(self)});
            self.change([&](Simulation& simulation) { simulation.set_servo_targets(targets); });
          },
          "Where servos drive their joints, in the order of scene.servos [rad, m]. NaN gives a servo back to its table.")
      .def(
          "set_gains",
          [](PySimulation& self, nb::handle factors) { self.to_change().set_gains(Numbers(factors, "factors", {servo_count(self)})); },
          "factors"_a, "Factors of the servos' stiffness and damping as the scene has them [servos].")
      .def(
          "set_friction",
          [](PySimulation& self, nb::handle force) {
            self.to_change().set_friction(Numbers(force, "force", {static_cast<std::ptrdiff_t>(self.look().effects().friction.size())}));
          },
          "force"_a, "Forces of joint friction in the order of scene.rubbing_joints [N m, N].")
      .def(
          "set_ground_friction", [](PySimulation& self, double coefficient) { self.to_change().set_ground_friction(coefficient); },
          "coefficient"_a, "Coulomb's coefficient of the ground.")
      .def(
          "set_wrench",
          [](PySimulation& self, const std::string& link, nb::handle force, nb::handle moment) {
            const Index slot = place_of(self.look().model(), link).slot;
            self.to_change().set_wrench(slot, Numbers(force, "force", {3}).three(), Numbers(moment, "moment", {3}).three());
          },
          "link"_a, "force"_a = nb::make_tuple(0.0, 0.0, 0.0), "moment"_a = nb::make_tuple(0.0, 0.0, 0.0),
          "The first wrench that the scene's effects name on that link's body, from now on: force [N] and moment [N m] in the directions "
          "and at the "
          "point that it was given with. A scene that names one of zero leaves it to be set.");
}

/// In time: steps, what acted in the last one, checkpoints.
void bind_steps(nb::class_<PySimulation>& c) {
  c.def("step", &step, "One step. Raises StepError, and leaves the state as it was, where it cannot be taken.")
      .def("advance_to", &advance_to, "t"_a,
           "Steps to the first node at or past t [s]; none where it is there already. Where steps vary too a motion has the same bits wherever it is "
           "stopped: t ends no step. Raises StepError as step does.")
      .def(
          "positions_at", [](PySimulation& self, double t) { return fixed_array(self.ask([&](Simulation& simulation) { return simulation.positions_at(t); })); },
          "t"_a,
          "Positions [nq] at a time within the last step of advance_to [s], by the cubic through positions and velocities at its ends. Raises InputError for "
          "other times.")
      .def("run", &run, "steps"_a,
           "So many steps. Raises StepError at the one that cannot be taken; KeyboardInterrupt ends it between two steps.")
      .def(
          "keep_forces", [](PySimulation& self) { self.to_change().keep_forces(); },
          "From the next step on what effects apply is kept, at the cost of a pass up the tree a step: for the five that follow.")
      .def_prop_ro(
          "couplings", [](PySimulation& self) { return self.ask([](Simulation& simulation) { return simulation.couplings(); }); },
          "Of each coupling of the model its gaps and forces.")
      .def(
          "assemble",
          [](PySimulation& self) {
            self.change([](Simulation& simulation) { require_closed(simulation.assemble()); });
          },
          "Moves q to where all couplings are closed, as near as the mass matrix measures; velocities stay. Raises InputError where they "
          "cannot be: q is then where they are least open.")
      .def_prop_ro("contacts", &contacts, "Every place where the ground pushes, then every one where bodies push each other, in the step taken last; needs keep_forces before it.")
      .def_prop_ro(
          "joint_forces", [](PySimulation& self) { return fixed_array(self.look().joint_forces()); },
          "Generalized forces of all effects together [nv; N m, N], mean over the last step; needs keep_forces before it.")
      .def_prop_ro(
          "servo_torques", [](PySimulation& self) { return fixed_array(self.look().servo_torques()); }, "Of each servo [N m, N], likewise.")
      .def_prop_ro(
          "body_wrenches",
          [](PySimulation& self) {
            std::vector<double> numbers = self.look().body_wrenches();
            const std::size_t slots = numbers.size() / 6;
            return fixed_array(std::move(numbers), {slots, 6});
          },
          "Of all effects on each body [bodies + 1 x 6], likewise: moment about its origin [N m], force [N], in the body's frame.")
      .def(
          "save", [](PySimulation& self, const std::string& file) { self.ask([&](Simulation& simulation) { simulation.save(file); }); },
          "file"_a, "All that the run depends on, into a file: one that goes on from it is equal to the bit.")
      .def(
          "checkpoint",
          [](PySimulation& self) {
            const std::string bytes = self.ask([](Simulation& simulation) { return simulation.checkpoint(); });
            return nb::bytes(bytes.data(), bytes.size());
          },
          "The same as bytes.")
      .def(
          "restore",
          [](PySimulation& self, nb::bytes bytes) {
            const std::string_view text(bytes.c_str(), bytes.size());
            self.change([&](Simulation& simulation) { simulation.restore(text); });
          },
          "checkpoint"_a, "What checkpoint() gave of a simulation of the same scene.")
      .def(
          "load", [](PySimulation& self, const std::string& file) { self.change([&](Simulation& simulation) { simulation.load(file); }); },
          "file"_a, "What was saved of the same scene.");
}

}  // namespace

void bind_simulations(nb::module_& m) {
  bind_joint(m);
  bind_contact(m);
  bind_coupling(m);
  nb::class_<PySimulation> c(m, "Simulation");
  c.def(nb::init<std::shared_ptr<Scene>>(), "scene"_a);
  bind_state(c);
  bind_controls(c);
  bind_steps(c);
}

}  // namespace linden::python
