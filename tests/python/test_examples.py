"""The gallery of examples runs, and does what it says."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import linden
from places import MODELS, ROOT

EXAMPLES = ROOT / "engine" / "python" / "examples"
# those that learn take minutes, and ranks are started by mpirun: they are tested where they belong
SHORT = sorted(file.name for file in EXAMPLES.glob("*.py") if not file.name.startswith(("learn", "ranks")))


def module_of(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("file", SHORT)
def test_examples_run(file: str, tmp_path: Path) -> None:
    given = [str(tmp_path)] if file == "rollouts.py" else []
    done = subprocess.run([sys.executable, "-W", "error", str(EXAMPLES / file), *given], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout and not done.stderr


@pytest.mark.parametrize("file", SHORT)
def test_examples_say_what_they_show(file: str) -> None:
    lines = (EXAMPLES / file).read_text().split('"""')[1].splitlines()
    assert any(f"python engine/python/examples/{file}" in line for line in lines)


def test_a_look_shows_a_fall() -> None:
    sim = module_of("look").look(MODELS / "humanoid.urdf")
    begin = linden.Simulation(sim.scene).centre_of_mass.position[2]
    assert begin - sim.centre_of_mass.position[2] == pytest.approx(0.5 * 9.81 * 0.5**2, rel=1e-6)


def test_torques_make_an_arm_follow() -> None:
    # joints move at up to 1.9 rad/s, and forces are those of the beginning of a step all over it
    assert module_of("torque").follow() < 1.9e-3


def test_rollouts_become_files(tmp_path: Path) -> None:
    module = module_of("rollouts")
    columns, rows = module.rollouts(instances=5, frames=4)
    assert rows.shape == (4, 5, len(columns))
    np.testing.assert_allclose(rows[:, 0, 0], [0, 0.01, 0.02, 0.03])
    files = module.write(tmp_path)
    table = np.loadtxt(files[0], delimiter=",", skiprows=1)
    assert table.shape == (800, len(columns) + 1)
    if len(files) > 1:
        h5py = pytest.importorskip("h5py")
        with h5py.File(files[1]) as file:
            np.testing.assert_allclose(file["rows"][...].reshape(800, -1), table[:, 1:], rtol=1e-12)


def test_accuracy_grows_with_order() -> None:
    band = module_of("accuracy").band
    (coarse, _), (fine, _), (high, _) = band(2, 2e-3, 2.0), band(2, 1e-3, 2.0), band(4, 1e-3, 2.0)
    assert coarse / fine == pytest.approx(4, rel=0.3)
    assert high < 0.01 * fine


def test_a_spring_of_ones_own_pulls_the_hand() -> None:
    module = module_of("own_effect")
    assert np.linalg.norm(module.pull().pose(module.HAND).position - module.ANCHOR) < 0.02


def test_a_policy_is_in_the_loop() -> None:
    batch, _ = module_of("policy").run(instances=16, acts=3)
    assert (batch.steps <= 60).all() and batch.steps.max() == 60
    assert len({tuple(row) for row in batch.targets}) == 16


def test_heavier_trunks_land_lower() -> None:
    masses, heights = module_of("randomize").sink(16)
    assert np.corrcoef(masses, heights)[0, 1] < -0.9
