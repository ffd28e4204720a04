"""Mechanisms with loops: couplings of scenes, alone and in a batch."""

from __future__ import annotations

import numpy as np
import pytest

import linden
from places import MODELS, SCENES

PIN = {"type": "hinge", "name": "pin", "between": ["coupler", "rocker"], "point": [2, 0, 2], "axis": [0, 1, 0]}


def test_a_loop_stays_closed_and_keeps_its_energy() -> None:
    sim = linden.Simulation(linden.load_scene(SCENES / "four_bar.yaml"))
    energy = sim.energy.total
    sim.run(2000)
    (pin,) = sim.couplings
    assert pin.name == "pin"
    assert pin.gaps.shape == pin.forces.shape == (5,)
    assert np.abs(pin.gaps).max() < 1e-11  # the tolerance
    assert list(pin.held_already).count(True) == 3
    assert np.abs(pin.forces).max() > 1
    assert sim.energy.total == pytest.approx(energy, abs=1e-3)


def test_a_spring_between_bodies_bears_a_weight() -> None:
    model = linden.load("ball-chain:1")
    spring = {"type": "spring", "name": "hung", "between": ["world", "link1"], "points": [[0, 0, 1], [0, 0, 0]], "stiffness": 1e3, "damping": 30}
    sim = linden.Simulation(model, couplings=[spring], effects={"gravity": [0, 0, -9.81]})
    (hung,) = sim.couplings
    assert hung.name == "hung"
    assert hung.gaps == pytest.approx([0], abs=1e-12)
    batch = linden.Batch(sim.scene, instances=3, observe=["q"])
    sim.run(200)
    batch.step(200)
    np.testing.assert_allclose(batch.q, np.tile(sim.q, (3, 1)), atol=1e-9)


def test_a_cable_bears_a_weight_and_its_length_is_a_joint() -> None:
    model = linden.load("ball-chain:1")
    cable = {"type": "cable", "name": "rope", "between": ["world", "link1"], "points": [[0, 0, 1], [0.4, 0, 0]], "length": 1.3}
    sim = linden.Simulation(model, couplings=[cable], effects={"gravity": [0, 0, -9.81], "damping": {"joint1": 0.5}})
    assert sim.q[sim.model.q_names.index("rope")] == pytest.approx(np.hypot(1, 0.4), abs=1e-12)
    sim.run(20_000)
    assert sim.q[sim.model.q_names.index("rope")] == pytest.approx(1.3, abs=1e-9)
    (rope,) = sim.couplings
    assert rope.forces[0] != 0
    assert np.abs(sim.v).max() < 1e-6
    batch = linden.Batch(sim.scene, instances=3, observe=["q"])
    again = linden.Simulation(sim.scene)
    again.run(500)
    batch.step(500)
    np.testing.assert_allclose(batch.q, np.tile(again.q, (3, 1)), atol=1e-8)


def test_instances_of_a_batch_move_as_a_simulation_does() -> None:
    scene = linden.load_scene(SCENES / "four_bar.yaml")
    batch, sim = linden.Batch(scene, instances=5, observe=["q"]), linden.Simulation(scene)
    batch.step(300)
    sim.run(300)
    np.testing.assert_allclose(batch.q, np.tile(sim.q, (5, 1)), atol=1e-9)


def test_an_open_start_is_refused_until_it_is_assembled() -> None:
    model = linden.load(MODELS / "four_bar.urdf")
    sim = linden.Simulation(model, couplings=[PIN], effects={"gravity": [0, 0, -9.81]})
    sim.q = [0.5, 0, 0]
    with pytest.raises(linden.InputError, match="pin.*is open by"):
        sim.step()
    sim.assemble()
    assert np.abs(sim.couplings[0].gaps).max() < 1e-12
    sim.step()
    with pytest.raises(linden.InputError, match="pin.*is open by"):
        linden.Batch(sim.scene, instances=2).reset(q=[[0.5, 0, 0], [0.5, 0, 0]])


def test_what_a_coupling_cannot_be_is_told() -> None:
    model = linden.load(MODELS / "four_bar.urdf")
    with pytest.raises(linden.InputError, match="did you mean \"rocker\""):
        linden.Simulation(model, couplings=[{**PIN, "between": ["coupler", "rocket"]}])
