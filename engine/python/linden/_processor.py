"""Chooses the module that this processor is fastest with, of those that the package was built with.

`_core` runs on every processor that the build was for. Where single trees are stepped wider registers are worth up to a factor of two, so a
wheel has modules for them besides; batches choose their instructions by themselves in any of them. The environment variable
LINDEN_PROCESSOR names one of them instead, as -march does, for results that are to be equal to the bit on other processors:
LINDEN_PROCESSOR=x86-64-v3.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys

V3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}
NEEDS = {"x86-64-v4": V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}, "x86-64-v3": V3}


def module_of(processor: str) -> str:
    return "_core_" + processor.replace("-", "_")


def flags_of_processor(cpuinfo: str = "/proc/cpuinfo") -> set[str]:
    """What Linux says that all processors of the machine have; nothing where it does not say."""
    try:
        with open(cpuinfo, encoding="ascii", errors="replace") as lines:
            flags = [set(line.partition(":")[2].split()) for line in lines if line.startswith("flags")]
    except OSError:
        return set()
    return set.intersection(*flags) if flags else set()


def chosen(asked: str | None, flags: set[str], built: set[str]) -> str:
    """The name of a processor of NEEDS, best first, whose module is among those that were built; "" stands for `_core`."""
    if asked is None:
        return next((name for name, needs in NEEDS.items() if name in built and needs <= flags), "")
    if asked not in built:
        known = ", ".join(sorted(built)) or "no other"
        raise ImportError(f'LINDEN_PROCESSOR is "{asked}"; this build of linden has {known}; leave it unset for the best')
    if not NEEDS.get(asked, set()) <= flags:
        missing = ", ".join(sorted(NEEDS[asked] - flags))
        raise ImportError(f'LINDEN_PROCESSOR is "{asked}"; this processor lacks {missing}; leave it unset for the best')
    return asked


def load(package: str) -> str:
    """Makes the module that is chosen the package's `_core`; returns the processor it is for."""
    built = {name for name in NEEDS if importlib.util.find_spec(f"{package}.{module_of(name)}") is not None}
    processor = chosen(os.environ.get("LINDEN_PROCESSOR") or None, flags_of_processor(), built)
    module = importlib.import_module(f"{package}.{module_of(processor) if processor else '_core'}")
    sys.modules[f"{package}._core"] = module
    setattr(sys.modules[package], "_core", module)
    return processor


processor = load(__package__)
