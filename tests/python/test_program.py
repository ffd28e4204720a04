"""The same numbers, to the bit, as the program `linden` gives for the same scene."""

from __future__ import annotations

import csv
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import linden
from places import MODELS, SCENES, program
from states import Array

RANDOMIZED = """
model: {models}/humanoid.urdf
base: floating
initial: {{base: {{position: [0, 0, 1.2]}}, seed: 5, spread: 0.05}}
start: as given
effects:
  gravity: [0, 0, -9.81]
  armature: 0.01
  damping: urdf
  friction: 0.3
  limits: urdf
  servo: {{stiffness: 800, damping: 40}}
  ground: {{stiffness: 1e5, damping: 500, friction: 0.8}}
randomize: {{masses: 0.2, friction: [0.4, 1.0], gains: 0.1, joint_friction: 0.3}}
"""


def linden_program(*arguments: str | Path) -> None:
    done = subprocess.run([program(), *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def randomized(tmp_path: Path) -> Path:
    file = tmp_path / "randomized.yaml"
    file.write_text(RANDOMIZED.format(models=MODELS))
    return file


def table(file: Path) -> dict[str, Array]:
    with file.open() as lines:
        rows = list(csv.reader(lines))
    numbers = np.array([[float(text) for text in row] for row in rows[1:]])
    return dict(zip(rows[0], numbers.T, strict=True))


@pytest.mark.parametrize("name", sorted(file.name for file in SCENES.glob("*.yaml")))
def test_a_run_of_a_scene_is_its_table(name: str, tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    linden_program("run", SCENES / name, "--duration", "0.2", "--record", file)
    expected = table(file)
    sim = linden.Simulation(SCENES / name)
    seen = sim.record(200, ["time", "q"])
    np.testing.assert_array_equal(seen["time"][:, 0], expected["time"])
    for k, row in enumerate(sim.model.q_names):
        np.testing.assert_array_equal(seen["q"][:, k], expected[row], err_msg=row)


@pytest.mark.parametrize("what", ["chain:20", "ball-chain:5", "paper-chain:6", "tree:15"])
def test_a_run_of_a_model_is_its_arrays(what: str, tmp_path: Path) -> None:
    file = tmp_path / "run.npz"
    linden_program("run", what, "--duration", "0.1", "--dt", "2e-3", "--record", file, "--what", "positions,velocities")
    data = np.load(file)
    seen = linden.Simulation(what, step=2e-3).record(50, ["q", "v", "time"])
    np.testing.assert_array_equal(seen["q"], data["q"][:, 0])
    np.testing.assert_array_equal(seen["v"], data["v"][:, 0])
    np.testing.assert_array_equal(seen["time"][:, 0], data["time"])


def test_a_run_goes_on_from_what_the_other_saved(tmp_path: Path) -> None:
    scene, saved, file = SCENES / "arm_sweep.yaml", tmp_path / "state", tmp_path / "rest.csv"
    sim = linden.Simulation(scene)
    sim.run(100)
    sim.save(str(saved))
    linden_program("run", scene, "--load", saved, "--duration", "0.1", "--record", file)
    sim.run(100)
    expected = table(file)
    np.testing.assert_array_equal(sim.q, [expected[row][-1] for row in sim.model.q_names])


def test_a_run_of_a_randomized_scene_is_its_table(randomized: Path, tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    linden_program("run", randomized, "--duration", "0.05", "--record", file)
    expected = table(file)
    sim = linden.Simulation(randomized)
    seen = sim.record(50, ["q"])["q"]
    for k, row in enumerate(sim.model.q_names):
        np.testing.assert_array_equal(seen[:, k], expected[row], err_msg=row)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("name", ["humanoid_drop.yaml", "arm_sweep.yaml", "pendulum_damped.yaml"])
def test_a_rollout_of_a_scene_is_a_batch_of_it(name: str, dtype: str, tmp_path: Path) -> None:
    file, figures = tmp_path / "rollout.npz", tmp_path / "rollout.json"
    single = ["--float"] if dtype == "float32" else []
    linden_program(
        "rollout", SCENES / name, "--instances", "13", "--duration", "0.05", "--seed", "4", "--spread", "0.02", "--start", "as-given",
        "--record", file, "--every", "10", "--json", figures, *single,
    )  # fmt: skip
    data = np.load(file)
    instructions = json.loads(figures.read_text())["instructions"]
    batch = linden.Batch(SCENES / name, 13, observe=["q", "v"], dtype=dtype, instructions=instructions)
    batch.reset(seed=4, spread=0.02)
    nq = batch.model.nq
    for frame in range(6):
        np.testing.assert_array_equal(batch.observations[:, :nq], data["q"][frame])
        np.testing.assert_array_equal(batch.observations[:, nq:], data["v"][frame])
        batch.step(10)


def test_a_rollout_of_a_randomized_scene_is_a_batch_of_it(randomized: Path, tmp_path: Path) -> None:
    file, figures = tmp_path / "rollout.npz", tmp_path / "rollout.json"
    linden_program(
        "rollout", randomized, "--instances", "11", "--duration", "0.03", "--seed", "5", "--spread", "0.05", "--start", "as-given",
        "--record", file, "--json", figures,
    )  # fmt: skip
    data = np.load(file)
    batch = linden.Batch(randomized, 11, instructions=json.loads(figures.read_text())["instructions"])
    batch.reset(seed=batch.scene.seed, spread=0.05)
    np.testing.assert_array_equal(batch.q, data["q"][0])
    np.testing.assert_array_equal(batch.ground_friction[:, 0], np.ravel(data["ground_friction"]))
    np.testing.assert_array_equal(batch.gains, data["gain_factors"])
    batch.step(30)
    np.testing.assert_array_equal(batch.q, data["q"][-1])
    assert len({tuple(row) for row in batch.q}) == 11


def test_a_scene_of_values_moves_as_its_file(randomized: Path) -> None:
    effects = {
        "gravity": [0, 0, -9.81], "armature": 0.01, "damping": "urdf", "friction": 0.3, "limits": "urdf",
        "servo": {"stiffness": 800, "damping": 40}, "ground": {"stiffness": 1e5, "damping": 500, "friction": 0.8},
    }  # fmt: skip
    said = linden.scene(
        linden.load(MODELS / "humanoid.urdf", "floating"),
        initial={"base": {"position": [0, 0, 1.2]}, "seed": 5, "spread": 0.05},
        start="as given",
        effects=effects,
        randomize={"masses": 0.2, "friction": [0.4, 1.0], "gains": 0.1, "joint_friction": 0.3},
    )
    read = linden.load_scene(randomized)
    for made in (said, read):
        assert made.has_ground and made.seed == 5
    a, b = linden.Batch(said, 5), linden.Batch(read, 5)
    a.step(20)
    b.step(20)
    np.testing.assert_array_equal(a.q, b.q)
    one, other = linden.Simulation(said), linden.Simulation(read)
    one.run(20)
    other.run(20)
    np.testing.assert_array_equal(one.q, other.q)
