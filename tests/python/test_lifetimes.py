"""Memory: nothing is left of what is made by the hundred thousand, nor at the end of a program."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

import linden

MEGABYTE = 1 << 20


def resident() -> int:
    """Bytes of this process in memory."""
    with open("/proc/self/statm") as line:
        return int(line.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


MODEL = linden.load("chain:2")
SCENE = linden.scene(MODEL)
SIMULATION = linden.Simulation(SCENE)
BATCH = linden.Batch(SCENE, 3, threads=1, observe=["q"])


def failing() -> None:
    with pytest.raises(linden.InputError):
        SIMULATION.pose("nowhere")


# one after another; a leak of 100 bytes of each is 10 MB
MAKERS: dict[str, Callable[[], object]] = {
    "Model": lambda: linden.load("chain:2"),
    "Scene": lambda: linden.scene(MODEL, step=1e-3),
    "Simulation": lambda: linden.Simulation(SCENE),
    "Batch": lambda: linden.Batch(SCENE, 3, threads=1, observe=["q"]),
    "Kinematics": SIMULATION.kinematics,
    "Joint": lambda: SIMULATION.joint("joint1"),
    "arrays": lambda: (SIMULATION.q, SIMULATION.mass_matrix(), SIMULATION.pose("link1").matrix, BATCH.q, BATCH.q_blocks),
    "a state set": lambda: setattr(SIMULATION, "q", [0.1, 0.2]),
    "steps": lambda: (SIMULATION.step(), BATCH.step()),
    "observations": lambda: SIMULATION.observe(["q", "energy"]),
    "names observed": lambda: BATCH.ask(["v"]),
    "resets": lambda: BATCH.reset([1], seed=3, spread=0.1),
    "errors": failing,
    "energies": lambda: SIMULATION.energies,
}
COUNTS = {"Scene": 20_000, "Batch": 20_000, "errors": 20_000, "resets": 20_000}


@pytest.mark.parametrize("what", MAKERS)
def test_a_hundred_thousand_leave_nothing(what: str) -> None:
    make, count = MAKERS[what], COUNTS.get(what, 100_000)
    for _ in range(count // 20):  # what is kept once for all, and the allocator's own room
        make()
    gc.collect()
    before = resident()
    for _ in range(count):
        make()
    gc.collect()
    assert resident() - before < 4 * MEGABYTE


def test_references_are_as_many_as_there_are() -> None:
    model = linden.load("chain:2")
    alone = sys.getrefcount(model)
    scene = linden.scene(model)
    sims = [linden.Simulation(scene) for _ in range(3)]
    del scene, sims
    gc.collect()
    assert sys.getrefcount(model) == alone
    sim = linden.Simulation("chain:2")
    alone = sys.getrefcount(sim)
    q, now, joint = sim.q, sim.kinematics(), sim.joint("joint1")
    del q, now, joint
    gc.collect()
    assert sys.getrefcount(sim) == alone


def test_an_array_outlives_what_gave_it() -> None:
    batch = linden.Batch("chain:2", 1000, observe=["q"])
    q, blocks, seen = batch.q, batch.q_blocks, batch.observations
    pose = linden.Simulation("chain:2").pose("link1").matrix
    del batch
    gc.collect()
    [np.ones(100_000) for _ in range(20)]
    assert (q == 0).all() and (blocks.reshape(-1)[:1000] == 0).all() and (seen == 0).all() and pose.shape == (4, 4)


def test_a_program_ends_without_a_word() -> None:
    """nanobind would tell of instances, types and functions that are left."""
    code = """
import linden, sys
sim = linden.Simulation("chain:3"); sim.run(10)
batch = linden.Batch("chain:3", 10, observe=["q", "pose:link1"]); batch.step(3)
kept = [sim, sim.q, sim.kinematics(), sim.joint("joint1"), sim.model, sim.scene, sim.pose("link1"), batch, batch.q_blocks, batch.layout]
sim.own = [sim]
try: sim.pose("nowhere")
except linden.InputError as error: told = error
kept.append(told)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr and not done.stdout, done.stderr
