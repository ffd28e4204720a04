// engine/python/queries.cpp
// What can be asked of a state (engine/queries).
#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/queries/centre_of_mass.hpp"
#include "engine/queries/imu.hpp"
#include "engine/queries/inverse_dynamics.hpp"
#include "engine/queries/jacobian.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/queries/mass_matrix.hpp"
#include "engine/queries/proximity.hpp"
#include "engine/queries/step_forces.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

std::vector<double> numbers_of(const Pose& pose) {
  const std::array<double, 7> numbers = position_and_quaternion(pose);
  return {numbers.begin(), numbers.end()};
}

FixedArray homogeneous(const Pose& pose) {
  const auto& R = pose.rotation;
  const auto& p = pose.shift;
  return fixed_array(std::vector<double>{R[0], R[1], R[2], p[0], R[3], R[4], R[5], p[1], R[6], R[7], R[8], p[2], 0, 0, 0, 1}, {4, 4});
}

void bind_values(nb::module_& m) {
  nb::class_<Pose>(m, "Pose", "Where a link's frame lies in the world: x_world = R x_link + p.")
      .def_prop_ro(
          "position", [](const Pose& self) { return fixed_array(std::span<const double>(self.shift)); }, "p [3; m].")
      .def_prop_ro(
          "quaternion",
          [](const Pose& self) {
            std::vector<double> numbers = numbers_of(self);
            return fixed_array(std::vector<double>(numbers.begin() + 3, numbers.end()));
          },
          "Of unit length, x y z w, w >= 0 [4].")
      .def_prop_ro(
          "rotation",
          [](const Pose& self) {
            return fixed_array(std::vector<double>(self.rotation.begin(), self.rotation.end()), {3, 3});
          },
          "R [3 x 3].")
      .def_prop_ro("matrix", &homogeneous, "[R p; 0 1] [4 x 4].")
      .def_prop_ro(
          "numbers", [](const Pose& self) { return fixed_array(numbers_of(self)); },
          "Position and quaternion, as in the q of a floating base [7].")
      .def("__repr__", [](const Pose& self) {
        std::vector<double> n = numbers_of(self);
        return fmt::format("Pose(position=[{:.6g}, {:.6g}, {:.6g}], quaternion=[{:.6g}, {:.6g}, {:.6g}, {:.6g}])", n[0], n[1], n[2], n[3],
                           n[4], n[5], n[6]);
      });
  nb::class_<CentreOfMass>(m, "CentreOfMass", "Of all that moves, world frame.")
      .def_ro("mass", &CentreOfMass::mass, "[kg]")
      .def_prop_ro(
          "position", [](const CentreOfMass& self) { return fixed_array(std::span<const double>(self.position)); }, "[3; m]")
      .def_prop_ro(
          "velocity", [](const CentreOfMass& self) { return fixed_array(std::span<const double>(self.velocity)); }, "[3; m/s]");
  nb::class_<Momentum>(m, "Momentum", "Of the whole system, world frame.")
      .def_prop_ro(
          "angular", [](const Momentum& self) { return fixed_array(std::span<const double>(self.angular)); }, "[3; kg m^2/s]")
      .def_prop_ro(
          "linear", [](const Momentum& self) { return fixed_array(std::span<const double>(self.linear)); }, "[3; kg m/s]");
  nb::class_<Energy>(m, "Energy", "Of the whole system [J].")
      .def_ro("kinetic", &Energy::kinetic)
      .def_ro("potential", &Energy::potential, "Of gravity, springs and the ground together.")
      .def_prop_ro("gravity", &Energy::gravity, "Zero where the centre of mass is at the height of the world's origin.")
      .def_ro("springs", &Energy::springs)
      .def_ro("ground", &Energy::ground)
      .def_prop_ro("total", &Energy::total)
      .def("__repr__", [](const Energy& self) {
        return fmt::format("Energy(kinetic={:.6g}, potential={:.6g}, total={:.6g})", self.kinetic, self.potential, self.total());
      });
}

std::optional<Numbers> if_given(nb::handle value, const char* name, std::ptrdiff_t count) {
  if (value.is_none()) return std::nullopt;
  return std::optional<Numbers>(std::in_place, value, name, std::initializer_list<std::ptrdiff_t>{count});
}
std::span<const double> span_of(const std::optional<Numbers>& numbers) {
  return numbers ? std::span<const double>(*numbers) : std::span<const double>();
}

void set_state(Kinematics& state, nb::handle q, nb::handle v, nb::handle a) {
  const Shape& shape = state.model().tree.shape;
  const Numbers positions(q, "q", {shape.positions});
  const auto velocities = if_given(v, "v", shape.velocities), accelerations = if_given(a, "a", shape.velocities);
  freely([&] { state.set(positions, span_of(velocities), span_of(accelerations)); });
}

/// [bodies + 1 x 6] or nothing.
std::optional<Numbers> outside_of(const Kinematics& state, nb::handle value) {
  if (value.is_none()) return std::nullopt;
  return std::optional<Numbers>(std::in_place, value, "outside", std::initializer_list<std::ptrdiff_t>{state.model().tree.shape.slots, 6});
}

FixedArray wrenches(const std::vector<SpatialForce>& list) {
  std::vector<double> numbers;
  for (const SpatialForce& one : list) {
    numbers.insert(numbers.end(), one.moment.begin(), one.moment.end());
    numbers.insert(numbers.end(), one.force.begin(), one.force.end());
  }
  return fixed_array(std::move(numbers), {list.size(), 6});
}

nb::typed<nb::dict, nb::str, FixedArray> answer_of(const StepForces& forces) {
  nb::dict answer;
  answer["joints"] = fixed_array(forces.joints);
  answer["across"] = wrenches(forces.across);
  return answer;
}

const LinkPlace& place_in(const Kinematics& state, const std::string& link) { return place_of(state.model(), link); }

/// The state that is asked.
void bind_asked_state(nb::class_<Kinematics>& c) {
  c.def(
       "__init__",
       [](Kinematics* self, const Model& model, nb::object q, nb::object v, nb::object a, nb::object gravity) {
         new (self) Kinematics(model);
         if (!q.is_none()) set_state(*self, q, v, a);
         if (!gravity.is_none()) self->set_gravity(Numbers(gravity, "gravity", {3}).three());
       },
       "model"_a, "q"_a = nb::none(), "v"_a = nb::none(), "a"_a = nb::none(), "gravity"_a = nb::none(), nb::keep_alive<1, 2>(),
       "A state of the model; what is not given is zero, and gravity 0 0 -9.81 m/s^2.\n\n"
       "q: positions [nq]; v, a: velocities and accelerations [nv]. Quaternions are normalised and mimic joints follow.")
      .def("set", &set_state, "q"_a, "v"_a = nb::none(), "a"_a = nb::none(), "Another state, in one pass over the tree.")
      .def_prop_rw(
          "gravity", [](const Kinematics& self) { return fixed_array(std::span<const double>(self.gravity())); },
          [](Kinematics& self, nb::handle value) { self.set_gravity(Numbers(value, "gravity", {3}).three()); }, "World frame [3; m/s^2].")
      .def_prop_rw(
          "armature", [](const Kinematics& self) { return fixed_array(self.armature()); },
          [](Kinematics& self, nb::handle value) { self.set_armature(Numbers(value, "armature", {self.model().tree.shape.velocities})); },
          "Inertia of the rotors, on the diagonal of the mass matrix [nv; kg m^2, kg]; empty: none.")
      .def_prop_ro("model", &Kinematics::model, nb::rv_policy::reference_internal)
      .def_prop_ro("q", [](const Kinematics& self) { return fixed_array(self.positions()); })
      .def_prop_ro("v", [](const Kinematics& self) { return fixed_array(self.velocities()); })
      .def_prop_ro("a", [](const Kinematics& self) { return fixed_array(self.accelerations()); });
}

/// Where things are and how they move.
void bind_motion(nb::class_<Kinematics>& c) {
  c.def(
       "pose", [](const Kinematics& self, const std::string& link) { return link_pose(self, place_in(self, link)); }, "link"_a,
       "Of a link's frame in the world's. Any link of the robot's file, those behind fixed joints too; an unknown one is an InputError "
       "with the "
       "nearest name, here and below.")
      .def(
          "twist",
          [](const Kinematics& self, const std::string& link, const std::string& frame) {
            return fixed_array(link_twist(self, place_in(self, link), frame_from(frame)));
          },
          "link"_a, "frame"_a = "aligned",
          "Angular and linear velocity [6; rad/s, m/s].\n\nframe: \"aligned\": of the link's origin, in the directions of the world; "
          "\"link\": in the "
          "link's own frame; \"world\": of what of the link passes the world's origin.")
      .def(
          "acceleration",
          [](const Kinematics& self, const std::string& link, const std::string& frame) {
            return fixed_array(link_acceleration(self, place_in(self, link), frame_from(frame)));
          },
          "link"_a, "frame"_a = "aligned",
          "Angular acceleration and that of the link's origin: the second derivative of its position [6; rad/s^2, m/s^2]. frame: "
          "\"aligned\" or \"link\".")
      .def(
          "spatial_acceleration",
          [](const Kinematics& self, const std::string& link, const std::string& frame) {
            return fixed_array(link_spatial_acceleration(self, place_in(self, link), frame_from(frame)));
          },
          "link"_a, "frame"_a = "aligned", "The derivative of the twist as that frame sees it while it stands still [6].")
      .def(
          "imu",
          [](const Kinematics& self, const std::string& link) {
            const ImuReading reading = imu(self, place_in(self, link));
            return fixed_array(SpatialMotion{reading.angular_velocity, reading.specific_force});
          },
          "link"_a,
          "What an IMU on a link reads, in the link's frame: angular velocity and specific force [6; rad/s, m/s^2]. At rest the force is "
          "9.81 upward.")
      .def(
          "jacobian",
          [](const Kinematics& self, const std::string& link, const std::string& frame) {
            return fixed_array(freely([&] { return link_jacobian(self, place_in(self, link), frame_from(frame)); }));
          },
          "link"_a, "frame"_a = "aligned", "J [6 x nv]: J v is the link's twist in that frame.")
      .def(
          "point_jacobian",
          [](const Kinematics& self, const std::string& link, nb::handle point) {
            const std::array<double, 3> at = Numbers(point, "point", {3}).three();
            return fixed_array(freely([&] { return point_jacobian(self, place_in(self, link), at); }));
          },
          "link"_a, "point"_a = nb::make_tuple(0.0, 0.0, 0.0),
          "J [3 x nv]: J v is the velocity of a point of the link, given in its frame [3; m], in the directions of the world.")
      .def_prop_ro("centre_of_mass", [](const Kinematics& self) { return centre_of_mass(self); })
      .def(
          "centre_of_mass_jacobian",
          [](const Kinematics& self) { return fixed_array(freely([&] { return centre_of_mass_jacobian(self); })); },
          "J [3 x nv]: J v is the velocity of the centre of mass.")
      .def(
          "momentum_matrix", [](const Kinematics& self) { return fixed_array(freely([&] { return momentum_matrix(self); })); },
          "A [6 x nv]: A v is the momentum of the whole system about the world's origin, angular, then linear.")
      .def_prop_ro(
          "momentum", [](const Kinematics& self) { return total_momentum(self); }, "About the world's origin.")
      .def_prop_ro(
          "centroidal_momentum", [](const Kinematics& self) { return centroidal_momentum(self); }, "About the centre of mass.");
}

/// Masses and forces.
void bind_dynamics(nb::class_<Kinematics>& c) {
  c.def(
       "mass_matrix", [](const Kinematics& self) { return fixed_array(freely([&] { return mass_matrix(self); })); },
       "M(q) with the armature on its diagonal [nv x nv], symmetric to rounding.")
      .def(
          "solve_mass_matrix",
          [](const Kinematics& self, nb::handle f) {
            const Numbers force(f, "f", {self.model().tree.shape.velocities});
            return fixed_array(freely([&] { return solve_mass_matrix(self, force); }));
          },
          "f"_a, "M(q)^-1 f [nv], in O(n): accelerations of forces, velocities of momenta.")
      .def(
          "forward_dynamics",
          [](const Kinematics& self, nb::handle tau) {
            const Numbers force(tau, "tau", {self.model().tree.shape.velocities});
            return fixed_array(freely([&] { return forward_dynamics(self, force); }));
          },
          "tau"_a, "Accelerations [nv] that joint forces tau [nv; N m, N] give the state, gravity with them, in O(n).")
      .def(
          "inverse_dynamics",
          [](const Kinematics& self, nb::handle outside) {
            const auto wrench = outside_of(self, outside);
            return fixed_array(freely([&] { return inverse_dynamics(self, span_of(wrench)); }));
          },
          "outside"_a = nb::none(),
          "Joint forces [nv; N m, N] of the state's q, v and a: M a + c - Q, by the recursive Newton-Euler algorithm.\n\n"
          "outside: wrenches on the bodies besides [bodies + 1 x 6]: moment about the body's origin, force, in the body's frame.")
      .def(
          "bias_forces", [](const Kinematics& self) { return fixed_array(freely([&] { return bias_forces(self); })); },
          "Joint forces of q and v with a = 0 [nv]: Coriolis, centrifugal and gyroscopic ones, less gravity's.")
      .def(
          "gravity_forces", [](const Kinematics& self) { return fixed_array(freely([&] { return gravity_forces(self); })); },
          "Generalized forces of gravity alone [nv].")
      .def(
          "joint_reactions",
          [](const Kinematics& self, nb::handle outside) {
            const auto wrench = outside_of(self, outside);
            return wrenches(freely([&] { return joint_reactions(self, span_of(wrench)); }));
          },
          "outside"_a = nb::none(),
          "The wrench across every joint [bodies + 1 x 6]: what the body that carries it gives the body behind it, bearings and drive "
          "together, in "
          "that body's frame, moment [N m] about its origin, force [N]; row 0: what all that hangs on the world gives it.");
}

/// Distances of links, and what is near what.
void bind_proximity(nb::module_& m) {
  nb::class_<LinkDistance>(m, "LinkDistance", "How far two links are apart, world frame.")
      .def_ro("distance", &LinkDistance::distance, "[m]; negative where they overlap, by the least shift that would part them.")
      .def_prop_ro(
          "normal", [](const LinkDistance& self) { return fixed_array(std::span<const double>(self.normal)); }, "From a to b, unit length [3].")
      .def_prop_ro(
          "on_a", [](const LinkDistance& self) { return fixed_array(std::span<const double>(self.on_a)); },
          "The nearest place of a; where they overlap that which reaches the farthest into b [3; m].")
      .def_prop_ro(
          "on_b", [](const LinkDistance& self) { return fixed_array(std::span<const double>(self.on_b)); }, "Likewise of b [3; m].")
      .def("__repr__", [](const LinkDistance& self) {
        return fmt::format("LinkDistance(distance={:.6g}, normal=[{:.6g}, {:.6g}, {:.6g}])", self.distance, self.normal[0], self.normal[1],
                           self.normal[2]);
      });
  nb::class_<NearPair>(m, "NearPair", "Two collision shapes that are near each other, and the points where they meet, world frame. What is near heights of "
                       "the world is so along one or several normals, a pair each.")
      .def_ro("link_a", &NearPair::link_a)
      .def_ro("link_b", &NearPair::link_b)
      .def_ro("distance", &NearPair::distance, "[m]; negative where they overlap, by the least shift that would part them.")
      .def_prop_ro(
          "normal", [](const NearPair& self) { return fixed_array(std::span<const double>(self.normal)); }, "From a to b, unit length [3].")
      .def_prop_ro(
          "places",
          [](const NearPair& self) {
            std::vector<double> numbers;
            for (const NearPoint& point : self.points) numbers.insert(numbers.end(), point.place.begin(), point.place.end());
            return fixed_array(std::move(numbers), {self.points.size(), 3});
          },
          "Midway between both surfaces [points x 3; m].")
      .def_prop_ro(
          "gaps",
          [](const NearPair& self) {
            std::vector<double> numbers;
            for (const NearPoint& point : self.points) numbers.push_back(point.gap);
            return fixed_array(std::move(numbers));
          },
          "Along the normal; negative where they overlap [points; m].")
      .def_prop_ro(
          "features",
          [](const NearPair& self) {
            std::vector<std::uint64_t> numbers;
            for (const NearPoint& point : self.points) numbers.push_back(point.feature);
            return numbers;
          },
          "Which corners, edges and faces meet: the same number as long as these do.")
      .def("__repr__", [](const NearPair& self) {
        return fmt::format("NearPair({} and {}, distance={:.6g}, {} points)", self.link_a, self.link_b, self.distance, self.points.size());
      });
  nb::class_<Proximity>(m, "Proximity",
                        "How far links are apart, which of them touch, and where: of the collision shapes of the robot's file, meshes as their "
                        "convex hulls. They do not act on each other.")
      .def(nb::init<const Model&, const LinkPairs&>(), "model"_a, "disabled"_a = LinkPairs{},
           "Reads the meshes: make it once.\n\ndisabled: pairs of links that near leaves out, beside neighbours; linden.srdf_disabled_pairs reads "
           "them from a file.")
      .def(
          "distance",
          [](const Proximity& self, const Kinematics& state, const std::string& link_a, const std::string& link_b) {
            return freely([&] { return self.distance(state, link_a, link_b); });
          },
          "state"_a, "link_a"_a, "link_b"_a,
          "Of the nearest collision shapes of two links, neighbours too. An unknown link, one without a collision shape, a link with itself and "
          "heights of the world, of which near tells, are an InputError.")
      .def(
          "near", [](const Proximity& self, const Kinematics& state, double margin) { return freely([&] { return self.near(state, margin); }); },
          "state"_a, "margin"_a,
          "All pairs of shapes no farther apart than the margin [m], in a fixed order. Left out are shapes of one body, neighbours in the tree, "
          "what a coupling ties, and disabled pairs.")
      .def_prop_ro("notes", &Proximity::notes, "Which meshes were not found or not read, and so touch nothing, and how many stand as their hulls.");
  m.def("srdf_disabled_pairs", &srdf_disabled_pairs, "file"_a,
        "The pairs of links that an SRDF file disables, <disable_collisions>. Raises InputError for a file that is not there or no SRDF.");
}

}  // namespace

Frame frame_from(const std::string& name) {
  const std::vector<std::string> names{"aligned", "link", "world"};
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<Frame>(found - names.begin());
  const std::string guess = nearest(name, names);
  throw InputError("frame: " + quoted(name) + " is not known; expected \"aligned\", \"link\" or \"world\"" +
                   (guess.empty() ? "" : "; did you mean " + guess + "?"));
}

void bind_queries(nb::module_& m) {
  bind_values(m);
  nb::class_<Kinematics> c(
      m, "Kinematics",
      "A state to be asked: where all bodies of a model are, how they move and how they accelerate. Vectors of six are angular "
      "first; quaternions are x y z w.");
  bind_asked_state(c);
  bind_motion(c);
  bind_dynamics(c);
  bind_proximity(m);
  m.def(
      "step_forces",
      [](const Model& model, nb::handle q0, nb::handle q1, nb::handle q2, double step, nb::handle gravity) {
        const std::ptrdiff_t nq = model.tree.shape.positions;
        const Numbers first(q0, "q0", {nq}), second(q1, "q1", {nq}), third(q2, "q2", {nq});
        const std::array<double, 3> g = Numbers(gravity, "gravity", {3}).three();
        return answer_of(freely([&] { return step_forces(model, first, second, third, step, g); }));
      },
      "model"_a, "q0"_a, "q1"_a, "q2"_a, "step"_a, "gravity"_a = nb::make_tuple(0.0, 0.0, -9.81));
}

}  // namespace linden::python
