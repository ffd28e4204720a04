"""How far links are apart: against balls and boxes whose distance is plain, and what cannot be asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import linden
from places import MODELS


def link(name: str, shape: str = "") -> str:
    collision = f"<collision><geometry>{shape}</geometry></collision>" if shape else ""
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    return f'<link name="{name}">{inertial}{collision}</link>'


def slide(name: str, parent: str, child: str, at: str) -> str:
    return (
        f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
    )


ROBOT = (
    '<robot name="r">'
    + link("base")
    + link("ball", '<sphere radius="0.2"/>')
    + link("plate", '<box size="1 1 0.1"/>')
    + link("block", '<box size="0.4 0.4 0.4"/>')
    + slide("s1", "base", "ball", "0 0 1")
    + slide("s2", "base", "plate", "0 0 0")
    + slide("s3", "base", "block", "0.2 0 0.251")
    + "</robot>"
)


@pytest.fixture
def sim() -> linden.Simulation:
    return linden.Simulation(linden.parse_urdf(ROBOT))


def test_the_distance_of_two_links_has_a_direction_and_two_places(sim: linden.Simulation) -> None:
    found = sim.distance("plate", "ball")
    assert found.distance == pytest.approx(0.75, abs=1e-14)
    np.testing.assert_allclose(found.normal, [0, 0, 1], atol=1e-14)
    np.testing.assert_allclose(found.on_a, [0, 0, 0.05], atol=1e-14)
    np.testing.assert_allclose(found.on_b, [0, 0, 0.8], atol=1e-14)
    q = sim.q.copy()
    q[sim.model.joints.index("s1")] = -0.76
    sim.q = q
    assert sim.distance("plate", "ball").distance == pytest.approx(-0.01, abs=1e-14)


def test_near_lists_the_pairs_within_the_margin_with_their_points(sim: linden.Simulation) -> None:
    (pair,) = sim.near(0.01)
    assert {pair.link_a, pair.link_b} == {"plate", "block"}
    assert pair.distance == pytest.approx(0.001, abs=1e-14)
    assert pair.places.shape == (4, 3)
    np.testing.assert_allclose(pair.gaps, 0.001, atol=1e-14)
    assert len(set(pair.features)) == 4
    assert sim.near(0.0005) == []


def test_an_srdf_file_disables_pairs(sim: linden.Simulation, tmp_path: Path) -> None:
    file = tmp_path / "r.srdf"
    file.write_text('<robot name="r"><disable_collisions link1="block" link2="plate" reason="Never"/></robot>')
    shapes = linden.Proximity(sim.model, linden.srdf_disabled_pairs(str(file)))
    assert shapes.near(sim.kinematics(), 0.01) == []
    assert shapes.notes == []


def test_what_cannot_be_asked_is_told(sim: linden.Simulation) -> None:
    with pytest.raises(linden.InputError, match='has no link "bal".*ball'):
        sim.distance("bal", "plate")
    with pytest.raises(linden.InputError, match='"base" has no collision shape'):
        sim.distance("base", "plate")
    with pytest.raises(linden.InputError, match="expected zero or more"):
        sim.near(float("inf"))


def test_the_distance_of_links_is_that_of_their_nearest_shapes() -> None:
    sim = linden.Simulation(linden.load(MODELS / "humanoid.urdf", base="floating"))
    nearest: dict[tuple[str, str], float] = {}
    for pair in sim.near(0.05):
        links = (pair.link_a, pair.link_b)
        nearest[links] = min(pair.distance, nearest.get(links, np.inf))
    assert len(nearest) > 3
    for (link_a, link_b), distance in nearest.items():
        assert sim.distance(link_a, link_b).distance == pytest.approx(distance, abs=1e-12)
