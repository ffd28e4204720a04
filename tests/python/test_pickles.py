"""Pickles, copies and checkpoints go on equal to the bit, in another process and without the files that a scene came from too."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import linden
from places import MODELS, SCENES
from states import Array


def by_pickle(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))


AGAIN: dict[str, Callable[[Any], Any]] = {"pickle": by_pickle, "copy": copy.copy, "deepcopy": copy.deepcopy}
again = pytest.mark.parametrize("twin_of", AGAIN.values(), ids=AGAIN)
scenes = pytest.mark.parametrize("name", sorted(file.name for file in SCENES.glob("*.yaml")))


def same_model(a: linden.Model, b: linden.Model) -> None:
    for name in ("name", "nq", "nv", "bodies", "joints", "links", "q_names", "v_names", "parents", "mass", "warnings", "notes"):
        assert getattr(a, name) == getattr(b, name), name
    for name in ("masses", "neutral", "lower", "upper", "max_velocity", "max_effort"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@again
@pytest.mark.parametrize("name", ["arm.urdf", "hand.urdf", "humanoid.urdf", "chain:7", "ball-chain:3", "random:9"])
def test_models_are_the_same(name: str, twin_of: Callable[[Any], Any]) -> None:
    model = linden.load(MODELS / name if name.endswith(".urdf") else name)
    twin = twin_of(model)
    same_model(model, twin)
    q = linden.Kinematics(model, np.linspace(-0.5, 0.5, model.nq)).q
    a, b = linden.Simulation(model), linden.Simulation(twin)
    for sim in (a, b):
        sim.q = q
        sim.run(20)
    np.testing.assert_array_equal(a.q, b.q)


@again
@scenes
def test_scenes_are_the_same(name: str, twin_of: Callable[[Any], Any]) -> None:
    scene = linden.load_scene(SCENES / name)
    twin = twin_of(scene)
    same_model(scene.model, twin.model)
    for entry in ("step", "order", "duration", "seed", "servos", "rubbing_joints", "has_ground"):
        assert getattr(scene, entry) == getattr(twin, entry), entry
    for entry in ("q", "v", "gravity", "limits"):
        np.testing.assert_array_equal(getattr(scene, entry), getattr(twin, entry), err_msg=entry)
    a, b = linden.Simulation(scene), linden.Simulation(twin)
    a.run(100)
    b.run(100)
    np.testing.assert_array_equal(a.q, b.q)
    np.testing.assert_array_equal(a.p, b.p)


def acted_on(sim: linden.Simulation) -> linden.Simulation:
    """All that a call can set, where the scene has it."""
    rng = np.random.default_rng(1)
    sim.run(20)
    sim.forces = rng.uniform(-1e-3, 1e-3, sim.model.nv) * np.any(sim.mass_matrix() != 0, axis=1)
    if sim.scene.servos:
        sim.targets = sim.targets + rng.uniform(-0.1, 0.1, len(sim.scene.servos))
        sim.set_gains(rng.uniform(0.8, 1.2, len(sim.scene.servos)))
    if sim.scene.rubbing_joints:
        sim.set_friction(rng.uniform(0, 0.1, len(sim.scene.rubbing_joints)))
    if sim.scene.has_ground:
        sim.set_ground_friction(0.6)
    sim.keep_forces()
    sim.run(20)
    return sim


def later(sim: linden.Simulation) -> list[Array]:
    sim.run(50)
    energies = np.array([sim.time, sim.energy.total, *sim.energies.values()])
    return [sim.q, sim.p, sim.v, sim.a, sim.forces, sim.targets, sim.joint_forces, energies]


def alike(found: list[Array], expected: list[Array]) -> None:
    for k, (a, b) in enumerate(zip(found, expected, strict=True)):
        np.testing.assert_array_equal(a, b, err_msg=str(k))


@again
@scenes
def test_simulations_go_on_equal_to_the_bit(name: str, twin_of: Callable[[Any], Any]) -> None:
    sim = acted_on(linden.Simulation(SCENES / name))
    twin = twin_of(sim)
    assert type(twin) is linden.Simulation and twin is not sim
    expected = later(sim)
    alike(later(twin), expected)


def test_a_copy_is_of_its_own() -> None:
    sim = linden.Simulation("chain:3")
    twin = copy.copy(sim)
    twin.run(10)
    assert sim.steps == 0 and twin.steps == 10
    many = linden.Batch("chain:3", 4, observe=["q"])
    other = copy.deepcopy(many)
    other.targets
    other.forces[...] = 0.1
    other.step(5)
    assert (many.steps == 0).all() and (many.forces == 0).all() and (many.observations == 0).all()


def wild(dtype: str) -> linden.Batch:
    scene = linden.scene(
        linden.load(MODELS / "humanoid.urdf", "floating"),
        initial={"base": {"position": [0, 0, 0.92]}},
        start="as given",
        effects={
            "gravity": [0, 0, -9.81], "armature": 0.01, "damping": "urdf", "friction": 0.3, "limits": "urdf",
            "servo": {"stiffness": 800, "damping": 40}, "ground": {"stiffness": 1e5, "damping": 500, "friction": 0.8},
        },
        randomize={"masses": 0.2, "friction": [0.4, 1.0]},
    )  # fmt: skip
    batch = linden.Batch(scene, 11, observe=["q", "v", "contact:left_foot"], dtype=dtype, threads=2)
    batch.reset(seed=3, spread=0.1)
    rng = np.random.default_rng(2)
    batch.targets[...] = rng.uniform(-0.1, 0.1, batch.targets.shape)
    batch.gains[...] = rng.uniform(0.8, 1.2, batch.gains.shape)
    batch.friction[...] = rng.uniform(0.1, 0.5, batch.friction.shape)
    batch.forces[...] = rng.uniform(-1, 1, batch.forces.shape)
    batch.ground_friction[...] = rng.uniform(0.3, 1, batch.ground_friction.shape)
    batch.gravity[...] = np.array([0, 0, -9.81]) + rng.uniform(-1, 1, batch.gravity.shape)
    batch.step(10)
    batch.forces[4] = 1e15  # one that fails
    batch.step(5)
    batch.targets[2] = 0.05  # written, and not yet taken in
    return batch


def compared(a: linden.Batch, b: linden.Batch) -> None:
    for name in ("q", "v", "energy", "status", "steps", "evaluations", "rescued", "observations", "targets", "forces", "gains", "friction"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for name in ("ground_friction", "gravity", "p_blocks"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    np.testing.assert_array_equal(a.get("inertia:thorax"), b.get("inertia:thorax"))
    assert [a.describe(i) for i in range(len(a))] == [b.describe(i) for i in range(len(b))]


@again
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_batches_go_on_equal_to_the_bit(dtype: str, twin_of: Callable[[Any], Any]) -> None:
    batch = wild(dtype)
    assert batch.failed.sum() == 1
    twin = twin_of(batch)
    compared(batch, twin)
    assert (twin.threads, twin.instructions, twin.dtype) == (batch.threads, batch.instructions, batch.dtype)
    assert list(twin.layout) == list(batch.layout)
    batch.step(20)
    twin.step(20)
    compared(batch, twin)


def moved_on(thing: bytes, n: int) -> Array:
    """In a process of its own."""
    made = pickle.loads(thing)
    if isinstance(made, linden.Scene):
        made = linden.Simulation(made)
    made.run(n) if isinstance(made, linden.Simulation) else made.step(n)
    return np.asarray(made.q)


def test_another_process_goes_on_without_the_files(tmp_path: Path) -> None:
    shutil.copytree(MODELS, tmp_path / "models")
    scene = linden.load_scene(tmp_path / "models" / "scenes" / "two_models.yaml")
    sim = acted_on(linden.Simulation(scene))
    batch = linden.Batch(scene, 5)
    batch.reset(seed=1, spread=0.1)
    batch.step(5)
    packed = [pickle.dumps(thing) for thing in (scene, sim, batch)]
    shutil.rmtree(tmp_path / "models")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.starmap(moved_on, [(bytes_, 30) for bytes_ in packed])
    fresh = linden.Simulation(scene)
    fresh.run(30)
    sim.run(30)
    batch.step(30)
    for there, here in zip(found, (fresh.q, sim.q, batch.q), strict=True):
        np.testing.assert_array_equal(there, here)


def test_files_go_on_equal_to_the_bit(tmp_path: Path) -> None:
    sim = acted_on(linden.Simulation(SCENES / "humanoid_drop.yaml"))
    sim.save(str(tmp_path / "sim"))
    other = linden.Simulation(SCENES / "humanoid_drop.yaml")
    other.load(str(tmp_path / "sim"))
    other.keep_forces()
    expected = later(sim)
    alike(later(other)[:6], expected[:6])

    batch = wild("float64")
    batch.save(tmp_path / "batch")
    twin = linden.Batch(batch.scene, len(batch), observe=list(batch.layout), threads=1)
    twin.load(tmp_path / "batch")
    compared(batch, twin)
    batch.step(10)
    twin.step(10)
    compared(batch, twin)


def test_a_checkpoint_goes_back_in_time() -> None:
    sim = linden.Simulation(SCENES / "arm_sweep.yaml")
    sim.run(50)
    kept, q = sim.checkpoint(), sim.q
    assert isinstance(kept, bytes)
    sim.run(50)
    expected = sim.q
    sim.restore(kept)
    np.testing.assert_array_equal(sim.q, q)
    sim.run(50)
    np.testing.assert_array_equal(sim.q, expected)
    batch = wild("float64")
    many = batch.checkpoint()
    batch.step(10)
    after = batch.q
    batch.reset()
    batch.restore(many)
    batch.step(10)
    np.testing.assert_array_equal(batch.q, after)


@pytest.mark.parametrize("cut", [0, 1, 40, -1])
def test_damaged_checkpoints_are_refused(cut: int) -> None:
    sim, batch = linden.Simulation("chain:3"), linden.Batch("chain:3", 4)
    for thing in (sim, batch):
        kept = thing.checkpoint()
        broken = kept[:cut] if cut >= 0 else kept[:-9] + bytes([kept[-9] ^ 255]) + kept[-8:]
        q = np.array(thing.q)
        with pytest.raises(linden.InputError):
            thing.restore(broken)
        np.testing.assert_array_equal(thing.q, q)


def test_checkpoints_of_something_else_are_refused() -> None:
    others: list[tuple[Any, Any, str]] = [
        (linden.Simulation("chain:3"), linden.Simulation("chain:4"), "model"),
        (linden.Simulation("chain:3"), linden.Simulation("chain:3", step=2e-3), "step"),
        (linden.Batch("chain:3", 4), linden.Batch("chain:3", 5), "instances"),
        (linden.Batch("chain:3", 4), linden.Batch("chain:3", 4, dtype=np.float32), "precision"),
        (linden.Batch("chain:3", 4), linden.Batch("chain:4", 4), "model"),
    ]
    for one, other, word in others:
        with pytest.raises(linden.InputError, match=word):
            other.restore(one.checkpoint())


