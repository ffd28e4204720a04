"""Motions to be looked at: pages and glTF from simulations, recordings and arrays."""

import json
import pathlib
import re
import struct

import numpy as np
import pytest

import linden
from places import ROOT

MODELS = ROOT / "models"


def header(page):
    return json.loads(re.search(r'id="linden-header">(.*?)</script>', page, re.S).group(1))


def glb(file):
    data = pathlib.Path(file).read_bytes()
    assert data[:4] == b"glTF"
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length])


def test_a_model_and_a_scene_are_shown_where_they_start():
    page = header(linden.view(linden.load(MODELS / "humanoid.urdf", base="floating")).page)
    assert page["frames"] == 1 and page["instances"] == 1
    assert page["bodies"] == list(linden.load(MODELS / "humanoid.urdf", base="floating").bodies)
    assert header(linden.view(linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml")).page)["frames"] == 1


def test_a_simulation_is_shown_as_it_goes_on_and_stays_where_it_is():
    sim = linden.Simulation(linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml"))
    sim.run(10)
    before = sim.checkpoint()
    assert header(sim.view().page)["frames"] == 1
    assert header(sim.view(0.5, fps=50).page)["frames"] == 26
    assert sim.checkpoint() == before


def test_positions_of_ones_own_are_shown(tmp_path):
    q = np.linspace(0, 1, 2 * 3 * 4).reshape(4, 2, 3)
    view = linden.view(q, "chain:3", times=[0.0, 0.1, 0.2, 0.4])
    assert header(view.page)["instances"] == 2 and header(view.page)["frames"] == 4
    view.save(tmp_path / "chain.glb")
    assert glb(tmp_path / "chain.glb")["asset"]["version"] == "2.0"
    view.save(tmp_path / "chain.html")
    assert (tmp_path / "chain.html").read_text() == view.page
    assert header(linden.view(q[:, 0], "chain:3").page)["instances"] == 1


def test_a_recording_is_shown(tmp_path):
    sim = linden.Simulation("chain:3")
    seen = sim.record(100, ["q"], every=5)["q"]
    np.savez(tmp_path / "chain.npz", q=seen[:, None], time=np.arange(21) * 5e-3, positions=np.array(sim.model.q_names))
    page = header(linden.view(tmp_path / "chain.npz", "chain:3", fps=200).page)
    assert page["frames"] == 21
    with pytest.raises(linden.InputError, match='there is no array "time"'):
        np.savez(tmp_path / "other.npz", q=seen)
        linden.view(tmp_path / "other.npz", "chain:3")
    with pytest.raises(linden.InputError, match="position .* of the model is not in it"):
        linden.view(tmp_path / "chain.npz", "ball-chain:3")


def test_a_notebook_gets_a_document_of_its_own():
    shown = linden.view("chain:3")._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and 'sandbox="allow-scripts"' in shown
    assert shown.count("<") == 2  # the page is within quotes


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: linden.view(np.zeros((3, 4)), "chain:3"), r"q: an array of shape \(3, 1, 4\) was given; expected \[frames, 3\]"),
        (lambda: linden.view(np.zeros((3, 3))), "model: positions and recordings are of a model"),
        (lambda: linden.view("chain:3", "chain:3"), "model: what is shown is a model itself"),
        (lambda: linden.view(np.zeros((2, 3)), "chain:3", times=[0, 0]), "times: "),
        (lambda: linden.view(np.full((2, 3), np.nan), "chain:3"), "is nan; expected finite numbers"),
        (lambda: linden.view("chain:3").save("chain.png"), "expected .html or .glb"),
        (lambda: linden.Simulation("chain:3").view(-1), "duration: -1 is given"),
        (lambda: linden.Simulation("chain:3").view(1, fps=0), "fps: 0 is given"),
    ],
)
def test_what_cannot_be_shown_is_refused_by_name(call, message):
    with pytest.raises(linden.InputError, match=message):
        call()
