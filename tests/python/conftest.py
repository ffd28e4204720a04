"""What all tests share: the package must be the installed one, and its warnings about robots' files are no news here."""

from __future__ import annotations

from pathlib import Path

import pytest

import linden
from humanoids import dropped
from places import ROOT


def pytest_configure(config: pytest.Config) -> None:
    found = Path(linden.__file__).resolve()
    if found.is_relative_to(ROOT / "engine"):
        raise pytest.UsageError(f"linden is imported from {found}; install the wheel, and test that")
    config.addinivalue_line("filterwarnings", "ignore::linden.InputWarning")


@pytest.fixture(scope="session")
def drop() -> linden.Scene:
    """A humanoid on its way to the ground, whose masses differ."""
    return dropped(seed=1)
