"""Which module is loaded on which processor."""

from __future__ import annotations

from pathlib import Path

import pytest

from linden import _processor
from linden._processor import NEEDS, V3, chosen, flags_of_processor

BOTH = {"x86-64-v3", "x86-64-v4"}


def test_the_best_that_is_built_and_can_run_is_chosen() -> None:
    everything = NEEDS["x86-64-v4"]
    assert chosen(None, everything, BOTH) == "x86-64-v4"
    assert chosen(None, everything, {"x86-64-v3"}) == "x86-64-v3"
    assert chosen(None, V3, BOTH) == "x86-64-v3"
    assert chosen(None, everything - {"fma"}, BOTH) == ""
    assert chosen(None, everything - {"avx512dq"}, BOTH) == "x86-64-v3"
    assert chosen(None, everything, set()) == ""
    assert chosen(None, set(), BOTH) == ""


def test_what_is_asked_for_is_loaded_or_told() -> None:
    assert chosen("x86-64-v3", NEEDS["x86-64-v4"], BOTH) == "x86-64-v3"
    with pytest.raises(ImportError, match="x86-64-v5.*has x86-64-v3, x86-64-v4"):
        chosen("x86-64-v5", NEEDS["x86-64-v4"], BOTH)
    with pytest.raises(ImportError, match="has no other"):
        chosen("x86-64-v3", V3, set())
    with pytest.raises(ImportError, match="lacks avx512bw.*avx512vl"):
        chosen("x86-64-v4", V3, BOTH)


def test_only_what_all_processors_of_the_machine_have_counts(tmp_path: Path) -> None:
    cpuinfo = tmp_path / "cpuinfo"
    cpuinfo.write_text("processor : 0\nflags : fpu avx2 fma\n\nprocessor : 1\nflags : fpu avx2\n")
    assert flags_of_processor(str(cpuinfo)) == {"fpu", "avx2"}
    assert flags_of_processor(str(tmp_path / "nothing")) == set()


def test_the_module_that_was_chosen_is_the_packages_core() -> None:
    import linden

    assert linden.processor == _processor.processor
    assert linden.Model.__module__ == "linden._core"
