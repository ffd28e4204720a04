"""What belongs to linden's own steps: forces of discrete motions, contacts, energies, momenta, joints by name."""

from __future__ import annotations

import numpy as np
import pytest

import linden
from places import MODELS, SCENES
from states import Array

GRAVITY = (0.0, 0.0, -9.81)

# a ball of 2 kg and 0.1 m
BALL = """<robot name="ball"><link name="ball"><inertial><mass value="2"/>
<inertia ixx="0.008" iyy="0.008" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""
# a block of 3 kg, which has four corners below
BLOCK = """<robot name="block"><link name="block"><inertial><mass value="3"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"""


def configurations(model: linden.Model, h: float) -> tuple[Array, Array, Array]:
    """A smooth motion at -h, 0 and h."""
    rng = np.random.default_rng(2)
    start, swing, beat = rng.uniform(-0.8, 0.8, (3, model.nq))
    at = lambda t: start + swing * np.sin((2 + beat) * t + beat)  # noqa: E731
    return at(-h), at(0.0), at(h)


@pytest.mark.parametrize("name", ["chain:6", "arm.urdf", "hand.urdf", "ball-chain:3"])
@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_step_forces_are_those_that_a_simulation_was_given(name: str, step: float) -> None:
    model = linden.load(MODELS / name if name.endswith("urdf") else name)
    rng = np.random.default_rng(1)
    sim = linden.Simulation(model, step=step, tolerance=1e-14)
    # of what a link's weight does at its joint, so that all joints move and none whirls
    scale = 0.1 * model.masses[-1]
    given, path = rng.uniform(-scale, scale, (5, model.nv)), [sim.q]
    free = np.any(sim.mass_matrix() != 0, axis=1)  # followers of mimic joints have no forces of their own
    given[:, ~free] = 0
    for force in given:
        sim.forces = force
        sim.step()
        path.append(sim.q)
    for k in range(1, len(given)):
        forces, across = linden.step_forces(model, path[k - 1], path[k], path[k + 1], step=step)
        assert across.shape == (len(model.bodies) + 1, 6)
        # of a force that is constant over every step half acts where the step begins, half where it ends
        acted = 0.5 * (given[k - 1] + given[k])
        # positions are known to 1e-16 and the solver's tolerance, of which the second difference is taken
        np.testing.assert_allclose(forces, acted, rtol=0, atol=1e-13 / step**2 * np.max(np.diag(sim.mass_matrix())))


@pytest.mark.parametrize("name", ["chain:6", "arm.urdf", "hand.urdf"])
def test_a_simulation_that_is_given_step_forces_goes_where_they_were_asked_for(name: str) -> None:
    model = linden.load(MODELS / name if name.endswith("urdf") else name)
    sim = linden.Simulation(model, step=1e-3, tolerance=1e-14)
    before = sim.q
    sim.step()
    for t in np.linspace(0, 1, 20):
        here = sim.q
        wanted = linden.Kinematics(model, 2 * here - before + 2e-6 * np.sin(3 * t + np.arange(model.nq))).q
        # half of the force of either step acts between them
        sim.forces = 2 * linden.step_forces(model, before, here, wanted, step=1e-3)[0] - sim.forces
        before = here
        sim.step()
        np.testing.assert_allclose(sim.q, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["chain:6", "arm.urdf"])
def test_step_forces_go_to_inverse_dynamics_by_the_square_of_the_step(name: str) -> None:
    model = linden.load(MODELS / name if name.endswith("urdf") else name)

    def error(h: float) -> float:
        q0, q1, q2 = configurations(model, h)
        # differences to fourth order of the same motion
        b0, _, b2 = configurations(model, 1e-3)
        c0, _, c2 = configurations(model, 2e-3)
        v = (8 * (b2 - b0) - (c2 - c0)) / 12e-3
        a = (16 * (b2 + b0) - (c2 + c0) - 30 * q1) / 12e-6
        exact = linden.Kinematics(model, q1, v, a, gravity=GRAVITY).inverse_dynamics()
        return float(np.linalg.norm(linden.step_forces(model, q0, q1, q2, step=h, gravity=GRAVITY)[0] - exact))

    assert error(0.02) / error(0.01) == pytest.approx(4, rel=0.1)


def test_forces_across_joints_of_a_discrete_rest_carry_the_weight() -> None:
    model = linden.load("chain:4")
    q = np.array([0.3, 0.2, -0.4, 0.1])
    forces, across = linden.step_forces(model, q, q, q, step=1e-3)
    state = linden.Kinematics(model, q)
    np.testing.assert_allclose(forces, state.bias_forces(), atol=1e-12)
    np.testing.assert_allclose(across, state.joint_reactions(), atol=1e-12)


def resting(urdf: str, height: float, **ground: float) -> linden.Simulation:
    sim = linden.Simulation(
        linden.parse_urdf(urdf, "floating"),
        step=1e-3,
        start="as given",
        initial={"base": {"position": [0.0, 0.0, height]}},
        effects={"gravity": list(GRAVITY), "ground": {"stiffness": 1e4, "damping": 200, "friction": 0.5, **ground}},
    )
    sim.keep_forces()
    sim.run(4000)
    return sim


def test_the_ground_carries_what_rests_on_it() -> None:
    sim = resting(BALL, 0.11)
    (contact,) = sim.contacts
    assert contact.body in sim.model.bodies
    # to the energy tolerance of the solver; it has rested for more than a hundred times of its damping
    np.testing.assert_allclose(contact.force, [0, 0, 2 * 9.81], atol=1e-6)
    np.testing.assert_allclose(contact.normal, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(contact.place[:2], [0, 0], atol=1e-9)
    assert sim.pose("ball").position[2] == pytest.approx(0.1 - 2 * 9.81 / 1e4, abs=1e-6)
    np.testing.assert_allclose(sim.body_wrenches[1], [0, 0, 0, 0, 0, 2 * 9.81], atol=1e-6)
    np.testing.assert_allclose(sim.v, np.zeros(6), atol=1e-9)
    assert sim.observe(["contact:ball"]) == pytest.approx([1, 2 * 9.81], abs=1e-5)


def test_shapes_of_the_world_carry_what_lies_on_them_and_are_named() -> None:
    sim = linden.Simulation(
        linden.parse_urdf(BALL, "floating"),
        step=1e-3,
        initial={"base": {"position": [0, 0, 0.85]}},
        world=[{"type": "box", "name": "table", "size": [1, 1, 0.1], "position": [0, 0, 0.7]}],
        effects={"gravity": list(GRAVITY), "contact": {"stiffness": 1e8}},
    )
    sim.keep_forces()
    sim.run(1000)
    (contact,) = sim.contacts
    assert contact.other == "world/table"
    assert sim.pose("ball").position[2] == pytest.approx(0.85, abs=1e-6)
    with pytest.raises(linden.InputError, match="world\\[0\\] has no type"):
        linden.scene("chain:2", world=[{"radius": 1}])


def test_generated_solids_have_contact_unless_effects_are_given() -> None:
    sim = linden.Simulation("boxes:2", step=1e-3)
    sim.run(100)
    assert sim.pose("box2").position[2] == pytest.approx(0.15, abs=1e-6)
    bare = linden.Simulation("boxes:2", step=1e-3, effects={"gravity": list(GRAVITY)})
    bare.run(100)
    assert bare.pose("box2").position[2] < 0.11


def test_four_corners_share_a_weight() -> None:
    sim = resting(BLOCK, 0.1)
    assert len(sim.contacts) == 4
    np.testing.assert_allclose([contact.force[2] for contact in sim.contacts], 4 * [3 * 9.81 / 4], atol=1e-5)
    places = np.array([contact.place for contact in sim.contacts])
    np.testing.assert_allclose(sorted(map(tuple, np.sign(places[:, :2]))), [(-1, -1), (-1, 1), (1, -1), (1, 1)])
    np.testing.assert_allclose(np.abs(places[:, :2]), np.full((4, 2), 0.1), atol=1e-6)


def test_bodies_push_each_other() -> None:
    scene = linden.load_scene(SCENES / "crates.yaml")
    sim = linden.Simulation(scene)
    sim.run(1500)
    sim.keep_forces()
    sim.step()
    between = [contact for contact in sim.contacts if contact.other]
    assert {(contact.body, contact.other) for contact in between} == {("above/crate", "below/crate")}
    assert sum(contact.force[2] for contact in between) == pytest.approx(204 * 9.81, abs=0.02)
    assert all(contact.normal[2] == pytest.approx(1, abs=1e-3) for contact in between)
    batch = linden.Batch(scene, 2, observe=["q", "energy"])
    batch.step(1501)
    np.testing.assert_allclose(batch.q, np.tile(sim.q, (2, 1)), atol=1e-6)
    assert (batch.rescued > 1000).all()


def test_contacts_are_asked_for_before_the_step() -> None:
    sim = linden.Simulation(SCENES / "humanoid_drop.yaml")
    sim.step()
    with pytest.raises(linden.InputError, match="keep_forces"):
        _ = sim.contacts
    with pytest.raises(linden.InputError, match="keep_forces"):
        _ = sim.joint_forces


def test_energies_by_effect_add_up_to_what_there_was() -> None:
    sim = linden.Simulation(SCENES / "humanoid_drop.yaml")
    stored = {"kinetic", "gravity", "springs", "ground"}

    def balance() -> float:
        shares = sim.energies
        assert set(shares) & stored >= {"kinetic", "gravity"}
        assert all(name in stored or name.endswith(("_taken", "_given")) for name in shares)
        return sum(-share if name.endswith("_given") else share for name, share in shares.items())

    begin = balance()
    sim.run(400)
    assert sim.energies["kinetic"] == pytest.approx(sim.energy.kinetic)
    assert sim.energies["damping_taken"] > 0.01
    # of some 200 J that turned over by then
    assert balance() == pytest.approx(begin, abs=0.2)


def test_energy_is_that_of_closed_forms() -> None:
    sim = linden.Simulation("chain:3", effects={"gravity": [0, 0, -9.81], "spring": {"joint2": {"stiffness": 3.0, "rest": 0.1}}})
    sim.q, sim.v = [0.2, 0.5, -0.3], [1.0, -2.0, 0.5]
    com = sim.centre_of_mass
    assert sim.energy.kinetic == pytest.approx(0.5 * sim.v @ sim.mass_matrix() @ sim.v, rel=1e-12)
    assert sim.energy.springs == pytest.approx(0.5 * 3 * 0.4**2, rel=1e-12)
    assert sim.energy.gravity == pytest.approx(com.mass * 9.81 * com.position[2], rel=1e-12)
    assert sim.energy.total == pytest.approx(sim.energy.kinetic + sim.energy.potential, rel=1e-12)
    assert sim.energy.potential == pytest.approx(sim.energy.gravity + sim.energy.springs + sim.energy.ground, rel=1e-12)


def test_momentum_stays_where_nothing_acts() -> None:
    sim = linden.Simulation(linden.load(MODELS / "humanoid.urdf", "floating"), effects={}, initial={"seed": 3, "spread": 0.5})
    angular, linear = sim.momentum.angular, sim.momentum.linear
    assert np.linalg.norm(angular) > 0.1
    sim.run(500)
    np.testing.assert_allclose(sim.momentum.angular, angular, rtol=0, atol=1e-9)
    np.testing.assert_allclose(sim.momentum.linear, linear, rtol=0, atol=1e-9)


def test_servos_and_joint_forces_are_those_of_the_law() -> None:
    sim = linden.Simulation("chain:2", effects={"servo": {"stiffness": 0.3, "damping": 0.02, "max_force": "none"}})
    assert sim.scene.servos == sim.model.v_names
    sim.targets = [0.4, -0.2]
    sim.keep_forces()
    sim.step()
    np.testing.assert_array_equal(sim.servo_torques, sim.joint_forces)
    assert sim.joint("joint1").torque == sim.servo_torques[0]
    assert sim.joint("joint1").target == 0.4
    # a servo this soft acts by the middle of the step, which goes from rest at zero to q
    middle, rate = 0.5 * sim.q, sim.q / 1e-3
    np.testing.assert_allclose(sim.servo_torques, 0.3 * ([0.4, -0.2] - middle) - 0.02 * rate, rtol=1e-9)
    sim.run(20000)
    np.testing.assert_allclose(sim.q, [0.4, -0.2], atol=1e-6)
    np.testing.assert_allclose(sim.servo_torques, [0, 0], atol=1e-5)


def test_joints_are_read_and_set_by_name() -> None:
    sim = linden.Simulation(MODELS / "arm.urdf")
    joint = sim.joint("joint_4")
    assert joint.name == "joint_4"
    joint.q, joint.v, joint.force = -0.5, 0.25, 2.0
    assert (joint.q, joint.force) == (-0.5, 2.0)
    assert joint.v == pytest.approx(0.25, abs=1e-12)
    assert sim.q[joint.q_rows] == [-0.5]
    assert sim.forces[joint.v_rows] == [2.0]
    k = sim.model.v_names.index("joint_4")
    assert (joint.lower, joint.upper) == (sim.model.lower[k], sim.model.upper[k])
    assert (joint.max_effort, joint.max_velocity) == (sim.model.max_effort[k], sim.model.max_velocity[k])


def test_a_wrench_acts_as_it_is_set() -> None:
    sim = linden.Simulation(
        linden.parse_urdf(BALL, "floating"), effects={"wrench": {"ball": {"force": [0, 0, 0]}}}, step=1e-3
    )
    sim.set_wrench("ball", force=[3, 0, 0], moment=[0, 0, 0.004])
    sim.run(100)
    np.testing.assert_allclose(sim.centre_of_mass.velocity, [0.15, 0, 0], atol=1e-9)
    np.testing.assert_allclose(sim.twist("ball")[:3], [0, 0, 0.05], atol=1e-9)
    np.testing.assert_allclose(sim.momentum.linear, [0.3, 0, 0], atol=1e-9)


def test_an_accelerating_body_reads_its_acceleration() -> None:
    sim = linden.Simulation(linden.parse_urdf(BALL, "floating"))
    sim.run(3)
    np.testing.assert_allclose(sim.a, [0, 0, 0, 0, 0, -9.81], atol=1e-8)
    np.testing.assert_allclose(sim.acceleration("ball"), [0, 0, 0, 0, 0, -9.81], atol=1e-8)
    np.testing.assert_allclose(sim.imu("ball"), np.zeros(6), atol=1e-8)


def test_observations_of_a_simulation_are_its_answers() -> None:
    sim = linden.Simulation(SCENES / "humanoid_drop.yaml")
    sim.run(30)
    joint, foot, momentum = sim.joint("left_knee_pitch"), sim.pose("left_foot"), sim.kinematics().momentum
    expected: dict[str, object] = {
        "q": sim.q,
        "v": sim.v,
        "a": sim.a,
        "targets": sim.targets,
        "time": [sim.time],
        "energy": [sim.energy.kinetic, sim.energy.potential],
        "com": sim.centre_of_mass.position,
        "com_velocity": sim.centre_of_mass.velocity,
        "momentum": [*momentum.angular, *momentum.linear],
        "pose:left_foot": foot.numbers,
        "position:left_foot": foot.position,
        "quaternion:left_foot": foot.quaternion,
        "twist:left_foot": sim.twist("left_foot"),
        "acceleration:head": sim.acceleration("head"),
        "imu:head": sim.imu("head"),
        "q:left_knee_pitch": [joint.q],
        "v:left_knee_pitch": [joint.v],
        "a:left_knee_pitch": sim.a[joint.v_rows],
        "target:left_knee_pitch": [joint.target],
    }
    for name, answer in expected.items():
        np.testing.assert_allclose(sim.observe([name]), np.asarray(answer, float), rtol=1e-11, atol=1e-11, err_msg=name)
    row = np.empty(len(sim.q) + 1)
    assert sim.observe(["q", "time"], out=row) is row
    np.testing.assert_array_equal(row, [*sim.q, sim.time])


def test_a_record_is_the_run() -> None:
    sim, other = linden.Simulation("chain:4"), linden.Simulation("chain:4")
    seen = sim.record(25, ["time", "q", "energy"], every=10)
    assert {name: rows.shape for name, rows in seen.items()} == {"time": (3, 1), "q": (3, 4), "energy": (3, 2)}
    for frame in range(3):
        np.testing.assert_array_equal(seen["q"][frame], other.q)
        assert seen["time"][frame, 0] == other.time
        other.run(10)
    assert sim.steps == 25
