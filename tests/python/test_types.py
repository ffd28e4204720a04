"""Types: examples and package are clean to mypy --strict, and the stubs of the compiled module say what is in it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import linden
from places import ROOT

pytest.importorskip("mypy", reason="mypy is not installed")
PACKAGE = Path(linden.__file__).parent


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of all of them, so that what was found of NumPy is kept from one to the next."""
    return tmp_path_factory.mktemp("types")


def run(*arguments: str, cwd: Path, module: str = "mypy") -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", module, *arguments], capture_output=True, text=True, cwd=cwd)


def mypy(*arguments: str, cwd: Path, module: str = "mypy") -> None:
    done = run(*arguments, cwd=cwd, module=module)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_says_that_it_has_types() -> None:
    assert (PACKAGE / "py.typed").exists()
    assert any(PACKAGE.glob("_core*.pyi"))


def test_the_package_is_clean(folder: Path) -> None:
    mypy("--strict", "-p", "linden", cwd=folder)


def test_examples_are_clean(folder: Path) -> None:
    examples = sorted(str(file) for file in (ROOT / "engine" / "python" / "examples").glob("*.py"))
    # what examples use where it is installed, and whose types are not
    settings = folder / "mypy.ini"
    others = "".join(f"[mypy-{name}.*]\nignore_missing_imports = true\n" for name in ("pandas", "h5py", "matplotlib", "mpi4py"))
    settings.write_text("[mypy]\nstrict = true\n" + others)
    mypy("--config-file", str(settings), *examples, cwd=folder)


# what is so of every class and function that nanobind makes: their kinds are its own, and signatures are in their docstrings alone
OF_NANOBIND = (
    "is a disjoint base at runtime, but isn't marked with @disjoint_base in the stub",
    "is inconsistent, metaclass differs",
    'is inconsistent, stub does not have *args parameter "args"',
    "is not a function",
    "__nb_enum__ is not present in stub",
)


def test_stubs_say_what_is_there(folder: Path) -> None:
    found = run("linden", "--concise", cwd=folder, module="mypy.stubtest").stdout.splitlines()
    assert found, "of functions that nanobind makes something is always said"
    assert not [line for line in found if not line.endswith(OF_NANOBIND)]


def test_a_wrong_use_is_found(folder: Path) -> None:
    """Types are worth something: what is wrong is found."""
    (folder / "wrong.py").write_text(
        'import linden\nsim = linden.Simulation("chain:3")\nsim.run("ten")\nsim.posee("link1")\nx: str = sim.q\n'
        'linden.Simulation("chain:3", stepp=1)\n'
    )
    done = run("--strict", "wrong.py", cwd=folder)
    found = [int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line]
    assert sorted(set(found)) == [3, 4, 5, 6], done.stdout
