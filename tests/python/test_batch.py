"""Many instances at once: equal bits whatever the threads, the company and the calls; rows in and out; what differs by instance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import linden
from humanoids import SEEN, N, acted, dropped, started
from places import MODELS

@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("threads", [2, 3])
def test_bits_do_not_depend_on_threads(drop: linden.Scene, threads: int, dtype: str) -> None:
    one, many = acted(started(drop, threads=1, dtype=dtype)), acted(started(drop, threads=threads, dtype=dtype))
    assert (one.threads, many.threads) == (1, threads)
    one.step(40)
    many.step(40)
    np.testing.assert_array_equal(one.q, many.q)
    np.testing.assert_array_equal(one.p_blocks, many.p_blocks)
    np.testing.assert_array_equal(one.observations, many.observations)
    assert (one.observations[:, -2] > 0).any(), "the ground was to be met"


def test_bits_do_not_depend_on_how_steps_are_split(drop: linden.Scene) -> None:
    whole, split = acted(started(drop)), acted(started(drop))
    whole.step(30)
    for n in (1, 7, 0, 12, 10):
        split.step(n)
    np.testing.assert_array_equal(whole.observations, split.observations)
    np.testing.assert_array_equal(whole.evaluations, split.evaluations)


def test_bits_do_not_depend_on_company(drop: linden.Scene) -> None:
    together = acted(started(drop))
    together.step(30)
    for place in (0, 7, N - 1):
        alone = linden.Batch(dropped(seed=1 + place), 1, observe=SEEN)
        alone.reset(seed=3 + place, spread=0.05)
        acted(alone, slice(place, place + 1))
        alone.step(30)
        np.testing.assert_array_equal(alone.observations[0], together.observations[place])


def test_bits_do_not_depend_on_who_asks(drop: linden.Scene) -> None:
    asked, silent = started(drop), started(drop)
    for _ in range(10):
        asked.step(2)
        asked.ask(["pose:head", "v"])
        _ = asked.q, asked.v, asked.energy, asked.status
    silent.step(20)
    np.testing.assert_array_equal(asked.observations, silent.observations)


def test_other_instructions_differ_by_rounding(drop: linden.Scene) -> None:
    best, scalar = started(drop), started(drop, instructions="scalar")
    assert scalar.instructions == "scalar" and scalar.lanes == 1
    best.step(10)
    scalar.step(10)
    np.testing.assert_allclose(best.q, scalar.q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("friction,tolerance", [(0.0, 1e-10), (0.4, 1e-7)])
def test_an_instance_moves_as_a_simulation(friction: float, tolerance: float) -> None:
    """To rounding, where joints do not stick; one that comes to stick does so to the solver's tolerance of energy, to its root in speed."""
    scene = linden.scene(
        linden.load(MODELS / "humanoid.urdf", "floating"),
        tolerance=1e-14,
        initial={"base": {"position": [0.0, 0.0, 2.0]}},
        effects={"gravity": [0, 0, -9.81], "armature": 0.01, "damping": "urdf", "servo": {"stiffness": 800, "damping": 40},
                 "ground": {"stiffness": 1e5, "damping": 500, "friction": 0.8}} | ({"friction": friction} if friction else {}),
    )  # fmt: skip
    batch = acted(started(scene))
    batch.gravity[...] = [0, 0, -9.81]
    sims = [linden.Simulation(scene) for _ in range(N)]
    for i, sim in enumerate(sims):
        sim.q, sim.v, sim.targets, sim.forces = batch.q[i], batch.v[i], batch.targets[i], batch.forces[i]
        sim.set_gains(batch.gains[i])
        sim.set_friction(batch.friction[i])
        sim.set_ground_friction(float(batch.ground_friction[i, 0]))
        sim.run(20)
    batch.step(20)
    np.testing.assert_allclose(batch.q, [sim.q for sim in sims], rtol=0, atol=tolerance)
    speeds = 20 * tolerance / 1e-3  # what positions differ by, over a step
    np.testing.assert_allclose(batch.v, [sim.v for sim in sims], rtol=0, atol=speeds)
    np.testing.assert_allclose(batch.observations, [sim.observe(SEEN) for sim in sims], rtol=0, atol=100 * speeds)


def test_masses_that_were_set_before_leave_no_trace(drop: linden.Scene) -> None:
    again, once = linden.Batch(drop, 4), linden.Batch(drop, 4)
    usual = once.get("inertia:thorax")
    again.set("inertia:thorax", 1.37 * usual)
    again.set("inertia:thorax", 0.71 * usual)
    once.set("inertia:thorax", 0.71 * usual)
    for batch in (again, once):
        batch.reset()
        batch.step(5)
    np.testing.assert_array_equal(again.get("inertia:thorax"), once.get("inertia:thorax"))
    np.testing.assert_array_equal(again.q, once.q)
    np.testing.assert_array_equal(again.energy, once.energy)


# -- rows in


@pytest.mark.parametrize("rows", ["targets", "forces", "gains", "friction", "ground_friction", "gravity"])
def test_rows_act_on_their_own_instance(drop: linden.Scene, rows: str) -> None:
    plain, changed = started(drop), started(drop)
    for batch in (plain, changed):
        batch.targets[...] = 0.1  # so that gains and friction matter
    before = getattr(changed, rows)[4].copy()
    getattr(changed, rows)[4] = 0.5 * before + 0.07
    plain.step(30)
    changed.step(30)
    differs = (plain.q != changed.q).any(axis=1)
    assert differs[4] and differs.sum() == 1
    assert getattr(changed, rows) is getattr(changed, rows)


def test_rows_are_assigned_whole_or_spread(drop: linden.Scene) -> None:
    batch = started(drop)
    kept = batch.targets
    batch.targets = 0.25
    assert batch.targets is kept and (kept == 0.25).all()
    batch.targets = np.arange(len(drop.servos))
    np.testing.assert_array_equal(kept[3], np.arange(len(drop.servos)))
    batch.gravity = [0, 0, -1.62]
    np.testing.assert_array_equal(batch.gravity, np.tile([0, 0, -1.62], (N, 1)))
    assert batch.ground_friction.shape == (N, 1)
    assert batch.friction.shape == (N, len(drop.rubbing_joints))


def test_forces_of_a_policy_are_those_of_a_simulation() -> None:
    batch, sim = linden.Batch("chain:5", 3, instructions="scalar"), linden.Simulation("chain:5")
    force = np.linspace(-0.02, 0.03, 5)
    batch.forces[1] = force
    sim.forces = force
    batch.step(50)
    sim.run(50)
    np.testing.assert_allclose(batch.q[1], sim.q, rtol=0, atol=1e-10)
    assert not np.allclose(batch.q[0], batch.q[1], atol=1e-4)


def test_gravity_of_an_instance_is_that_of_a_scene() -> None:
    moon = linden.Batch("chain:5", 4, effects={"gravity": [0, 0, -1.62]})
    batch = linden.Batch("chain:5", 4)
    batch.gravity[2] = [0, 0, -1.62]
    batch.step(100)
    moon.step(100)
    np.testing.assert_array_equal(batch.q[2], moon.q[2])
    assert (batch.q[1] != moon.q[1]).any()


# -- reset


def test_a_mask_a_list_and_all_begin_again(drop: linden.Scene) -> None:
    def all_but(chosen: list[int], again: Callable[[linden.Batch], None]) -> None:
        batch = started(drop)
        batch.step(20)
        before, steps = batch.q, batch.steps
        again(batch)
        rest = [i for i in range(N) if i not in chosen]
        np.testing.assert_array_equal(batch.q[rest], before[rest])
        np.testing.assert_array_equal(batch.steps[rest], steps[rest])
        np.testing.assert_array_equal(batch.q[chosen], np.tile(drop.q, (len(chosen), 1)))
        assert (batch.steps[chosen] == 0).all()
        np.testing.assert_array_equal(batch.observations[:, : batch.model.nq], batch.q)

    mask = np.zeros(N, bool)
    mask[[2, 5, 18]] = True
    all_but([2, 5, 18], lambda batch: batch.reset(mask))
    all_but([2, 5, 18], lambda batch: batch.reset([2, 5, 18]))
    all_but([2, 5, 18], lambda batch: batch.reset(np.array([2, 5, 18], np.int32)))
    all_but([], lambda batch: batch.reset(np.zeros(N, bool)))
    all_but([], lambda batch: batch.reset([]))
    all_but([7], lambda batch: batch.reset(7))
    all_but(list(range(N)), lambda batch: batch.reset())


def test_a_reset_takes_one_row_or_one_for_each(drop: linden.Scene) -> None:
    batch = started(drop)
    q = np.tile(drop.q, (2, 1))
    q[:, 2] = [1.5, 2.5]
    v = np.zeros(batch.model.nv)
    v[5] = -1.0
    batch.reset([3, 4], q, v)
    np.testing.assert_array_equal(batch.q[[3, 4]], q)
    np.testing.assert_allclose(batch.v[[3, 4]], [v, v], atol=1e-12)


def test_seeds_are_by_instance_and_repeat(drop: linden.Scene) -> None:
    a, b = linden.Batch(drop, N), linden.Batch(drop, N)
    a.reset(seed=10, spread=0.1)
    b.step(5)
    b.reset([2, 9], seed=10, spread=0.1)
    np.testing.assert_array_equal(a.q[[2, 9]], b.q[[2, 9]])
    np.testing.assert_array_equal(a.get("mass:pelvis")[[2, 9]], b.get("mass:pelvis")[[2, 9]])
    np.testing.assert_array_equal(a.ground_friction[[2, 9]], b.ground_friction[[2, 9]])
    c = linden.Batch(drop, N)
    c.reset(seed=11, spread=0.1)
    np.testing.assert_array_equal(a.q[1:], c.q[:-1])
    assert len({tuple(row) for row in a.q}) == N
    assert (np.abs(a.q - drop.q)[:, 7:] <= 0.1 + 1e-12).all()


def test_what_was_set_stays_over_a_reset(drop: linden.Scene) -> None:
    batch = started(drop)
    batch.set("mass:head", 9.0, [1])
    batch.targets[1] = 0.1
    batch.reset()
    assert batch.get("mass:head")[1] == pytest.approx(9.0)
    assert (batch.targets[1] == 0.1).all()


# -- by name


def test_parameters_are_set_and_read_by_name(drop: linden.Scene) -> None:
    batch = started(drop)
    joint = "left_knee_pitch"
    servo, row = drop.servos.index(joint), batch.model.v_names.index(joint)
    for name, rows, column in (
        ("target", batch.targets, servo),
        ("gain", batch.gains, servo),
        ("friction", batch.friction, drop.rubbing_joints.index(joint)),
        ("force", batch.forces, row),
    ):
        batch.set(f"{name}:{joint}", 0.3, [1, 2])
        assert (rows[[1, 2], column] == 0.3).all() and rows[0, column] != 0.3
        batch.set(f"{name}:{joint}", np.linspace(0.1, 0.9, N))
        np.testing.assert_array_equal(batch.get(f"{name}:{joint}"), np.linspace(0.1, 0.9, N))
    batch.set("ground_friction", 0.7, 3)
    assert batch.get("ground_friction")[3] == 0.7
    batch.set("gravity", [0, 0, -3.7], [0, 1])
    np.testing.assert_array_equal(batch.get("gravity")[1], [0, 0, -3.7])
    batch.set("mass:left_foot", np.arange(1.0, N + 1))
    np.testing.assert_allclose(batch.get("mass:left_foot"), np.arange(1.0, N + 1), rtol=1e-14)
    # the sole is fixed to the foot, and both are one body
    np.testing.assert_array_equal(batch.get("mass:left_sole"), batch.get("mass:left_foot"))
    inertia = batch.get("inertia:left_foot")
    assert inertia.shape == (N, 10)
    np.testing.assert_allclose(inertia[4] / inertia[4, 0], inertia[0] / inertia[0, 0], rtol=1e-12)
    batch.set("inertia:left_foot", inertia[2], 5)
    np.testing.assert_array_equal(batch.get("inertia:left_foot")[5], inertia[2])


def test_a_mass_that_was_set_is_that_which_moves() -> None:
    batch = linden.Batch("chain:1", 2, observe=["v"], effects={})
    batch.set("mass:" + batch.model.bodies[0], 3 * batch.model.masses[0], 1)
    batch.reset()
    batch.forces[...] = 1e-3
    batch.step(10)
    assert batch.observations[0, 0] == pytest.approx(3 * batch.observations[1, 0], rel=1e-9)


# -- failures


def test_a_failure_is_frozen_and_described() -> None:
    batch = linden.Batch("chain:3", 5, observe=["q"])
    good = linden.Batch("chain:3", 5)
    batch.forces[2] = 1e12
    batch.step(10)
    good.step(10)
    assert list(np.flatnonzero(batch.failed)) == [2]
    assert linden.Status(int(batch.status[2])) != linden.Status.converged
    assert batch.status.dtype == np.uint8 and batch.status[0] == linden.Status.converged
    assert batch.describe(2) and not batch.describe(0)
    assert list(batch.steps) == [10, 10, 0, 10, 10]
    assert np.isfinite(batch.observations).all()
    np.testing.assert_array_equal(np.delete(batch.q, 2, 0), np.delete(good.q, 2, 0))
    batch.forces[2] = 0
    batch.reset(batch.failed)
    batch.step(10)
    assert not batch.failed.any() and list(batch.steps) == [20, 20, 10, 20, 20]
    np.testing.assert_array_equal(batch.q[2], good.q[2])
