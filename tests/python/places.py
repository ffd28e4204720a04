"""Where the tests find models, robots and the program.

LINDEN_ROOT     the repository, whose models and pages are used; usually that of this file
LINDEN_ROBOTS   a folder of URDF files of real robots, no part of the repository; usually ../shared/robots beside it
LINDEN_PROGRAM  the program `linden` of the same build as the package; what compares them is skipped without it
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("LINDEN_ROOT", Path(__file__).resolve().parents[2])).resolve()
MODELS = ROOT / "models"
SCENES = MODELS / "scenes"
ROBOTS = Path(os.environ.get("LINDEN_ROBOTS", ROOT.parent / "shared" / "robots"))

NINE_ROBOTS = (
    "allegro_right_hand",
    "anymal_c",
    "double_pendulum_continuous",
    "g1_29dof",
    "panda",
    "pr2",
    "solo12",
    "talos",
    "ur5",
)
OWN_ROBOTS = ("arm", "hand", "humanoid")


def robot_file(name: str) -> Path:
    """Of a robot by name; skips the test where it is not there."""
    if name in OWN_ROBOTS:
        return MODELS / f"{name}.urdf"
    file = ROBOTS / f"{name}.urdf"
    if not file.exists():
        pytest.skip(f"{file} is not there")
    return file


def program() -> str:
    """The program `linden`; skips the test where LINDEN_PROGRAM does not say where it is."""
    path = os.environ.get("LINDEN_PROGRAM")
    if not path:
        pytest.skip("LINDEN_PROGRAM is not set")
    return path
