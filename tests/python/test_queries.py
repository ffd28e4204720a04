"""What can be asked of a state, against definitions: a plain robot that reads the URDF by itself, sums over all links, and differences."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import linden
from places import NINE_ROBOTS, OWN_ROBOTS, robot_file
from plain_robot import PlainRobot
from random_trees import random_tree
from states import Array, difference, random_state

# Sums over some hundred links of products of numbers of about one: some 1e3 roundings.
ROUNDING = 1e-12
# Differences of fourth order with h = 1e-4: roundings of 1e-16 over 1e-4, times numbers of about ten.
DIFFERENCE = 1e-9

BODIES = [*OWN_ROBOTS, *NINE_ROBOTS, "random:1", "random:2", "random:3"]
SUBJECTS = [pytest.param((name, base), id=f"{name}-{base}") for name in BODIES for base in ("fixed", "floating")]


class Subject:
    """A robot in linden, the same by definition, and a state."""

    def __init__(self, name: str, base: str) -> None:
        text = random_tree(int(name[7:])) if name.startswith("random:") else robot_file(name).read_text()
        self.plain = PlainRobot(text, base == "floating")
        self.model = linden.parse_urdf(text, base)
        self.state = random_state(self.model, 3)
        placed = self.plain.poses(self.model, self.state.q)
        self.links = [link for link in self.model.links if link in placed]
        self.weights = [weight for weight in self.plain.inertias() if weight[0] in self.links]

    def some_links(self) -> list[str]:
        """At most eight, spread over all: differences take their time."""
        return self.links[:: max(1, len(self.links) // 8)]


@lru_cache(maxsize=None)
def made(name: str, base: str) -> Subject:
    return Subject(name, base)


@pytest.fixture
def subject(request: pytest.FixtureRequest) -> Subject:
    return made(*request.param)


def every_robot(test):  # type: ignore[no-untyped-def]
    return pytest.mark.parametrize("subject", SUBJECTS, indirect=True)(test)


def close(found: Array, expected: Array, tolerance: float) -> None:
    """Relative to the largest number, or to one."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0) <= tolerance * max(1, np.abs(expected).max(initial=0))


def spatial(mass: float, c: Array, about: Array) -> Array:
    """Inertia [6, 6] about the link's origin, angular first."""
    cross = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    return np.block([[about - mass * cross @ cross, mass * cross], [-mass * cross, mass * np.eye(3)]])


def gyroscopic(inertia: Array, V: Array) -> Array:
    """V x* (I V)."""
    h = inertia @ V
    return np.array([*(np.cross(V[:3], h[:3]) + np.cross(V[3:], h[3:])), *np.cross(V[:3], h[3:])])


@every_robot
def test_links_are_where_the_file_puts_them(subject: Subject) -> None:
    assert len(subject.links) >= len(subject.plain.joints)
    for name, (R, p) in subject.plain.poses(subject.model, subject.state.q).items():
        if name not in subject.links:
            continue
        pose = subject.state.pose(name)
        close(pose.rotation, R, ROUNDING)
        close(pose.position, p, ROUNDING)
        close(pose.matrix, np.block([[R, p[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]), ROUNDING)
        close(pose.numbers, [*pose.position, *pose.quaternion], 0)
        assert pose.quaternion[3] >= 0 and abs(np.linalg.norm(pose.quaternion) - 1) < ROUNDING


@every_robot
def test_twists_are_rates_of_poses(subject: Subject) -> None:
    for link in subject.some_links():
        aligned = subject.state.twist(link)
        close(aligned[3:], difference(lambda s: s.pose(link).position, subject.state), DIFFERENCE)
        turning = difference(lambda s: s.pose(link).rotation, subject.state) @ subject.state.pose(link).rotation.T
        close(aligned[:3], [turning[2, 1], turning[0, 2], turning[1, 0]], DIFFERENCE)
        pose = subject.state.pose(link)
        close(subject.state.twist(link, "link"), [*(pose.rotation.T @ aligned[:3]), *(pose.rotation.T @ aligned[3:])], ROUNDING)
        close(subject.state.twist(link, "world"), [*aligned[:3], *(aligned[3:] - np.cross(aligned[:3], pose.position))], ROUNDING)


@every_robot
def test_accelerations_are_rates_of_twists(subject: Subject) -> None:
    state = subject.state
    for link in subject.some_links():
        aligned = state.acceleration(link)
        rotation = state.pose(link).rotation
        close(aligned, difference(lambda s: s.twist(link), state), DIFFERENCE)
        close(state.acceleration(link, "link"), [*(rotation.T @ aligned[:3]), *(rotation.T @ aligned[3:])], ROUNDING)
        for frame in ("link", "world"):
            close(state.spatial_acceleration(link, frame), difference(lambda s, f=frame: s.twist(link, f), state), DIFFERENCE)
        V = state.twist(link)
        close(state.spatial_acceleration(link), [*aligned[:3], *(aligned[3:] - np.cross(V[:3], V[3:]))], ROUNDING)


@every_robot
def test_an_imu_feels_what_is_not_free_fall(subject: Subject) -> None:
    state = subject.state
    for link in subject.some_links():
        back = state.pose(link).rotation.T
        felt = state.acceleration(link)[3:] - state.gravity
        close(state.imu(link), [*(back @ state.twist(link)[:3]), *(back @ felt)], ROUNDING)


@every_robot
def test_jacobians_carry_velocities_to_twists(subject: Subject) -> None:
    state, model = subject.state, subject.model
    rng = np.random.default_rng(1)
    for link in subject.some_links():
        point = rng.uniform(-0.3, 0.3, 3)
        for v in rng.uniform(-1, 1, (3, model.nv)):
            moving = linden.Kinematics(model, state.q, v)
            for frame in ("aligned", "link", "world"):
                close(state.jacobian(link, frame) @ v, moving.twist(link, frame), ROUNDING)
            place = lambda s: s.pose(link).position + s.pose(link).rotation @ point  # noqa: E731
            close(state.point_jacobian(link, point) @ v, difference(place, moving), DIFFERENCE)
        close(state.point_jacobian(link), state.jacobian(link)[3:], ROUNDING)


@every_robot
def test_the_centre_of_mass_is_the_mean_of_all_links(subject: Subject) -> None:
    state, model = subject.state, subject.model
    moving = [weight for weight in subject.weights if np.any(state.jacobian(weight[0]))]
    com = state.centre_of_mass
    close(com.mass, sum(mass for _, mass, _, _ in moving), ROUNDING)
    close(com.mass, model.mass, ROUNDING)
    close(com.mass, np.sum(model.masses), ROUNDING)
    places = [mass * (state.pose(link).position + state.pose(link).rotation @ c) for link, mass, c, _ in moving]
    close(com.position, np.sum(places, axis=0) / com.mass, ROUNDING)
    close(com.velocity, difference(lambda s: s.centre_of_mass.position, state), DIFFERENCE)
    close(state.centre_of_mass_jacobian() @ state.v, com.velocity, ROUNDING)


@every_robot
def test_momentum_is_the_sum_over_all_links(subject: Subject) -> None:
    state = subject.state
    linear, angular = np.zeros(3), np.zeros(3)
    for link, mass, c, about in subject.weights:
        pose, V = state.pose(link), state.twist(link)
        arm = pose.rotation @ c
        push = mass * (V[3:] + np.cross(V[:3], arm))
        linear += push
        angular += pose.rotation @ about @ pose.rotation.T @ V[:3] + np.cross(pose.position + arm, push)
    close(state.momentum.linear, linear, ROUNDING)
    close(state.momentum.angular, angular, ROUNDING)
    close(state.momentum_matrix() @ state.v, [*angular, *linear], ROUNDING)
    close(state.centroidal_momentum.linear, linear, ROUNDING)
    close(state.centroidal_momentum.angular, angular - np.cross(state.centre_of_mass.position, linear), ROUNDING)


@every_robot
def test_the_mass_matrix_is_the_sum_over_all_links(subject: Subject) -> None:
    state, model = subject.state, subject.model
    M = np.zeros((model.nv, model.nv))
    for link, mass, c, about in subject.weights:
        J = state.jacobian(link, "link")
        M += J.T @ spatial(mass, c, about) @ J
    close(state.mass_matrix(), M, ROUNDING)
    close(state.mass_matrix(), state.mass_matrix().T, 1e-15)


@every_robot
def test_solving_by_the_mass_matrix_undoes_it(subject: Subject) -> None:
    state, model = subject.state, subject.model
    M = state.mass_matrix()
    f = M @ np.random.default_rng(2).uniform(-1, 1, model.nv)
    close(M @ state.solve_mass_matrix(f), f, ROUNDING * 10)


@every_robot
def test_armature_is_on_the_diagonal(subject: Subject) -> None:
    state, model = subject.state, subject.model
    with_rotors = linden.Kinematics(model, state.q, state.v, state.a)
    armature = np.zeros(model.nv)
    leaders = [k for k in range(model.nv) if np.any(state.mass_matrix()[k]) and not model.v_names[k].startswith("base.")]
    armature[leaders] = 0.3
    with_rotors.armature = armature
    close(with_rotors.mass_matrix(), state.mass_matrix() + np.diag(armature), ROUNDING)
    f = with_rotors.mass_matrix() @ np.random.default_rng(4).uniform(-1, 1, model.nv)
    close(with_rotors.mass_matrix() @ with_rotors.solve_mass_matrix(f), f, ROUNDING * 10)


@every_robot
def test_forces_of_a_motion_are_those_of_all_links(subject: Subject) -> None:
    """d'Alembert: each link's rate of momentum less its weight, carried to the joints by its Jacobian."""
    state, model = subject.state, subject.model
    coasting = linden.Kinematics(model, state.q, state.v, gravity=state.gravity)
    bias, weight, forces = np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
    for link, mass, c, about in subject.weights:
        J, inertia, V = state.jacobian(link, "link"), spatial(mass, c, about), state.twist(link, "link")
        pull = mass * state.pose(link).rotation.T @ state.gravity
        own = J.T @ np.array([*np.cross(c, pull), *pull])
        weight += own
        bias += J.T @ (inertia @ coasting.spatial_acceleration(link, "link") + gyroscopic(inertia, V)) - own
        forces += J.T @ (inertia @ state.spatial_acceleration(link, "link") + gyroscopic(inertia, V)) - own
    close(state.gravity_forces(), weight, ROUNDING)
    close(state.bias_forces(), bias, ROUNDING)
    close(state.inverse_dynamics(), forces, ROUNDING)


@every_robot
def test_forward_dynamics_undo_inverse_dynamics(subject: Subject) -> None:
    state = subject.state
    M = state.mass_matrix()
    # what a light joint does under a force is known to the share that its inertia has of the largest
    close(M @ state.forward_dynamics(state.inverse_dynamics()), M @ state.a, ROUNDING * 10)


@every_robot
def test_power_of_joints_is_the_rate_of_energy(subject: Subject) -> None:
    def energy(s: linden.Kinematics) -> float:
        return float(0.5 * s.v @ s.mass_matrix() @ s.v - s.centre_of_mass.mass * (s.gravity @ s.centre_of_mass.position))

    state = subject.state
    # along the motion, so that v is the rate of q for followers too
    close(state.v @ state.inverse_dynamics(), difference(energy, state), 1e-8)


@every_robot
def test_what_goes_through_a_joint_moves_all_behind_it(subject: Subject) -> None:
    """Of each joint's wrench the size of force and moment about the joint, which no frame changes: the rates of momentum of all links behind
    it less their weight."""
    state, model = subject.state, subject.model
    across = state.joint_reactions()
    assert across.shape == (len(model.bodies) + 1, 6)
    slots = dict(zip(model.joints, across[1:], strict=True))
    parent_of = {joint.find("child").get("link"): joint.find("parent").get("link") for joint in subject.plain.joints}
    for joint in subject.plain.joints:
        if joint.get("name") not in slots:
            continue
        child = joint.find("child").get("link")
        about = state.pose(child).position
        force, moment = np.zeros(3), np.zeros(3)
        for link, mass, c, inertia in subject.weights:
            above = link
            while above != child and above in parent_of:
                above = parent_of[above]
            if above != child:
                continue
            pose, V, A = state.pose(link), state.twist(link), state.acceleration(link)
            arm, turned = pose.rotation @ c, pose.rotation @ inertia @ pose.rotation.T
            push = mass * (A[3:] + np.cross(A[:3], arm) + np.cross(V[:3], np.cross(V[:3], arm)) - state.gravity)
            force += push
            moment += turned @ A[:3] + np.cross(V[:3], turned @ V[:3]) + np.cross(pose.position + arm - about, push)
        found = slots[joint.get("name")]
        close(
            [np.linalg.norm(found[3:]), np.linalg.norm(found[:3]), found[3:] @ found[:3]],
            [np.linalg.norm(force), np.linalg.norm(moment), force @ moment],
            ROUNDING * 10,
        )


def test_a_hanging_chain_pulls_by_its_weight() -> None:
    # a chain lies along x
    model = linden.load("chain:6")
    state = linden.Kinematics(model, gravity=[9.81, 0, 0])
    weights = 9.81 * np.cumsum(model.masses[::-1])[::-1]
    across = state.joint_reactions()
    # the world is pulled, and each link is held by what hangs below it
    close(np.linalg.norm(across[1:, 3:], axis=1), weights, ROUNDING)
    close(across[0], [0, 0, 0, weights[0], 0, 0], ROUNDING)
    close(across[1:, :3], np.zeros((6, 3)), ROUNDING)
    close(state.inverse_dynamics(), np.zeros(6), ROUNDING)


def test_wrenches_from_outside_are_taken_off() -> None:
    model = linden.load("chain:3")
    state = linden.Kinematics(model, [0.3, 0.4, 0.5], [1, 2, 3], [3, 2, 1])
    outside = np.zeros((4, 6))
    assert np.array_equal(state.inverse_dynamics(outside), state.inverse_dynamics())
    # a force on the last body that its joint alone would have to give: what it gives is less by its moment about every joint
    outside[3] = [0, 0, 0.7, 0, 0, 0]
    close(state.inverse_dynamics(outside)[2], state.inverse_dynamics()[2] - 0.7, ROUNDING)
    close(state.joint_reactions(outside)[3], state.joint_reactions()[3] - outside[3], ROUNDING)


@pytest.mark.parametrize("name", ["ball-chain:4", "random:12"])
def test_joints_that_turn_freely_move_as_their_velocities_say(name: str) -> None:
    model = linden.load(name)
    state = random_state(model, 5)
    for link in model.links:
        V = state.twist(link)
        turning = difference(lambda s: s.pose(link).rotation, state) @ state.pose(link).rotation.T
        rate = difference(lambda s: s.pose(link).position, state)
        close(V, [turning[2, 1], turning[0, 2], turning[1, 0], *rate], DIFFERENCE)
        close(state.acceleration(link), difference(lambda s: s.twist(link), state), DIFFERENCE)
        close(state.jacobian(link) @ state.v, V, ROUNDING)


def test_a_simulation_is_asked_what_its_state_is() -> None:
    sim = linden.Simulation("chain:5")
    sim.q, sim.v = np.linspace(0.1, 0.5, 5), np.linspace(-1, 1, 5)
    sim.run(10)
    link = sim.model.links[-1]
    now = linden.Kinematics(sim.model, sim.q, sim.v, sim.a, gravity=sim.scene.gravity)
    np.testing.assert_array_equal(sim.pose(link).matrix, now.pose(link).matrix)
    np.testing.assert_array_equal(sim.twist(link), now.twist(link))
    np.testing.assert_array_equal(sim.acceleration(link), now.acceleration(link))
    np.testing.assert_array_equal(sim.imu(link), now.imu(link))
    np.testing.assert_array_equal(sim.jacobian(link, "link"), now.jacobian(link, "link"))
    np.testing.assert_array_equal(sim.mass_matrix(), now.mass_matrix())
    np.testing.assert_array_equal(sim.bias_forces(), now.bias_forces())
    np.testing.assert_array_equal(sim.centre_of_mass.position, now.centre_of_mass.position)
    a = np.arange(5.0)
    close(sim.inverse_dynamics(a), sim.mass_matrix() @ a + sim.bias_forces(), ROUNDING)
    kept = sim.kinematics()
    before = kept.q
    sim.run(10)
    np.testing.assert_array_equal(kept.q, before)
    assert np.any(sim.q != before)
