"""Steps that vary with the motion, and positions between them."""

from __future__ import annotations

import json
import pathlib
import pickle

import numpy as np
import pytest

import linden


def test_an_accuracy_is_kept_and_the_motion_is_the_same_however_it_is_cut_up() -> None:
    straight, pieces = linden.Simulation("chain:10", accuracy=1e-5), linden.Simulation("chain:10", accuracy=1e-5)
    start = straight.energy.total
    report = straight.advance_to(1.0)
    for t in np.linspace(0.1, 1.0, 10):
        pieces.advance_to(t)
        assert pieces.time >= t
        pieces.positions_at(t)
        pieces = pickle.loads(pickle.dumps(pieces))
    np.testing.assert_array_equal(pieces.q, straight.q)
    assert pieces.time == straight.time and pieces.steps == straight.steps == report.steps
    lengths = straight.step_lengths
    assert lengths is not None and lengths.kept and lengths.steps == straight.steps
    assert lengths.shortest < 0.5 * lengths.longest
    assert abs(straight.energy.total - start) < 1e-5 * straight.energy.kinetic


def test_fixed_steps_go_to_a_time_too() -> None:
    sim = linden.Simulation("chain:3", step=1e-3)
    assert sim.advance_to(0.0105).steps == 11
    assert sim.step_lengths is None and sim.last_step == 1e-3
    between = sim.positions_at(0.0105)
    assert (np.abs(between - sim.q) < 0.01).all() and (between != sim.q).any()
    assert sim.advance_to(0.005).steps == 0


def test_what_makes_no_sense_is_refused() -> None:
    sim = linden.Simulation("chain:3", accuracy=1e-3)
    sim.advance_to(0.1)
    with pytest.raises(linden.InputError, match="within the last step of advance_to"):
        sim.positions_at(0.01)
    with pytest.raises(linden.InputError, match="expected a finite time"):
        sim.advance_to(float("inf"))
    with pytest.raises(linden.InputError, match="accuracy"):
        linden.Simulation("chain:3", accuracy=1e-30)
    with pytest.raises(linden.InputError, match="a batch takes steps of one length"):
        linden.Batch("chain:3", 4, accuracy=1e-3)
    with pytest.raises(linden.InputError, match="the step is auto, and no accuracy is named"):
        linden.Simulation("chain:3", step="auto")


def test_a_view_of_steps_that_vary_has_the_duration_that_was_asked_for(tmp_path: pathlib.Path) -> None:
    sim = linden.Simulation("chain:5", accuracy=1e-3)
    file = tmp_path / "whip.glb"
    sim.view(0.5, fps=20).save(file)
    assert sim.time == 0  # of a copy
    data = file.read_bytes()
    scene = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    times = [scene["accessors"][sampler["input"]] for sampler in scene["animations"][0]["samplers"]]
    assert all(0.5 <= one["max"][0] < 0.52 and one["count"] == 11 for one in times)
