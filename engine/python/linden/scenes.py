"""Models and scenes: from files, from text, and from what a program says."""

from __future__ import annotations

import copyreg
import os
import warnings
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Model, Scene
from .errors import InputError, InputWarning

MOST_WARNINGS = 5


class Settings(TypedDict, total=False):
    """What a scene says beside its model, with the keys of a scene's file: models/scenes/README.md."""

    step: float | str
    """h [s], 1e-3 where it is not given; with an accuracy "auto", as where it is not given, for steps that vary with the motion."""
    accuracy: float
    """Energy band over the largest kinetic energy that steps are to keep: order and steps follow from it. A Batch has none."""
    duration: float
    """[s], for those who run a scene to its end."""
    order: int
    """2, 4, 6 or 8; a Batch has 2 alone."""
    solver: str
    guess: str
    tolerance: float
    stop: str
    max_iterations: int
    max_splits: int
    initial: dict[str, Any]
    """{"base": ..., "positions": {joint: number}, "velocities": ..., "seed": ..., "spread": ...}."""
    start: str
    """"checked", or "as given": begins outside limits or in the ground all the same."""
    effects: dict[str, Any]
    """{"gravity": [0, 0, -9.81], "servo": {"stiffness": 200}, "ground": {...}, ...}. What is not named is not there, gravity included."""
    world: list[dict[str, Any]]
    """Shapes that stand in the world: [{"type": "box", "name": "table", "size": [1, 1, 0.1], "position": [0, 0, 0.7]},
    {"type": "plane", "normal": [0, 0, 1], "height": 0}, ...]; all types in models/scenes/README.md, "The world"."""
    randomize: dict[str, Any]
    """{"masses": 0.2, "friction": [0.4, 1.0], ...}: what is drawn for each instance."""


def _tell(texts: list[str], stacklevel: int) -> None:
    for text in texts[:MOST_WARNINGS]:
        warnings.warn(text, InputWarning, stacklevel=stacklevel + 1)
    if len(texts) > MOST_WARNINGS:
        warnings.warn(f"and {len(texts) - MOST_WARNINGS} more: see model.warnings", InputWarning, stacklevel=stacklevel + 1)


def load(name: str | os.PathLike[str], base: str | None = None, density: float | None = None) -> Model:
    """A URDF file, or a generated model: chain:N, ball-chain:N, paper-chain:N, tree:N, random:N, humanoids:N, and with loops ring:N,
    fourbars:N, ladder:N, roller-chain:N, net:AxB, and loose solids boxes:N, wall:N, pile:N, cards:N, dominoes:N.

    base: "fixed" (where it is not given) or "floating", for URDF files. density: of links that have shapes and no inertia [kg/m^3].
    Raises InputError with file and line. What was read with a grain of salt is told as an InputWarning, and is in model.warnings.
    """
    model = _core.load_model(os.fspath(name), base, density)
    _tell(model.warnings, 2)
    return model


def parse_urdf(text: str, base: str = "fixed", density: float | None = None, source: str = "urdf") -> Model:
    """A model from the text of a URDF file; `source` stands for the file in messages. Else as load."""
    model = _core.parse_urdf(text, source, base, density)
    _tell(model.warnings, 2)
    return model


def load_scene(
    file: str | os.PathLike[str], seed: int | None = None, spread: float | None = None, density: float | None = None
) -> Scene:
    """A scene from its YAML file. seed, spread and density go over what the file says. Raises InputError with file and line."""
    if spread is not None and not spread >= 0:
        raise InputError(f"spread: {spread} is given; expected a number, zero or more")
    loaded = _core.load_scene(os.fspath(file), seed, spread, density)
    _tell(loaded.model.warnings, 2)
    return loaded


def scene(model: Model | str | os.PathLike[str] | None = None, **settings: Unpack[Settings]) -> Scene:
    """A scene of a model and of settings, with the keys of a scene's file; gravity is 0 0 -9.81 m/s^2 where no `effects` are given, and the
    loose solids that are generated have contact.

    Without a model the settings name it, as a file would: scene(model=None, models=[...]) for several. Files are found relative to the
    current folder. Raises InputError that names the key.
    """
    return made_scene(model, settings, 2)


def made_scene(source: Model | Scene | str | os.PathLike[str] | None, settings: Any, stacklevel: int) -> Scene:
    """What a Simulation or a Batch was given, as a scene."""
    if isinstance(source, Scene):
        if settings:
            given = ", ".join(settings)
            raise InputError(f"{given}: given beside a scene, which says it all; expected settings beside a model alone")
        return source
    if isinstance(source, str | os.PathLike):
        name = os.fspath(source)
        if name.endswith((".yaml", ".yml")):
            loaded = _core.load_scene(name, None, None, None)
            _tell(loaded.model.warnings, stacklevel + 1)
            return made_scene(loaded, settings, stacklevel)
        source = _core.load_model(name, None, None)
        _tell(source.warnings, stacklevel + 1)
    elif not (isinstance(source, Model) or (source is None and ("model" in settings or "models" in settings))):
        kind = type(source).__name__
        raise TypeError(f"model: {kind} is given; expected a Model, a Scene, or the name of a file or of a generated model")
    known = len(source.warnings) if source is not None else 0
    values = dict(settings)
    effects: dict[str, Any] = {"gravity": [0, 0, -9.81]}
    if source is not None and _core.needs_contact(source.name):
        effects["contact"] = {"friction": 0.6}  # as linden run has it
    values.setdefault("effects", effects)
    made = _core.scene_of(source, values)
    _tell(made.model.warnings[known:], stacklevel + 1)
    return made


def step_forces(
    model: Model, q0: ArrayLike, q1: ArrayLike, q2: ArrayLike, step: float, gravity: ArrayLike = (0.0, 0.0, -9.81)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inverse dynamics of a discrete motion: the forces with which linden's own steps go from q0 by q1 to q2, a step [s] apart each.

    At q1 half of the force of the step before acts and half of that of the step after: a simulation that has come from q0 under f0 goes
    on to q2 where its `forces` are 2 f - f0.

    Returns the joint forces [nv; N m, N] and the wrench across every joint [bodies + 1, 6]. Raises InputError for wrong shapes, numbers
    that are not finite, and where a body turns by half a turn or more in a step.
    """
    answer = _core.step_forces(model, q0, q1, q2, step, gravity)
    return answer["joints"], answer["across"]


def _restored_model(data: bytes) -> Model:
    return _core.model_from_bytes(data)


def _restored_scene(data: bytes) -> Scene:
    return _core.scene_from_bytes(data)


# they are pickled whole, without the files that they came from
copyreg.pickle(Model, lambda model: (_restored_model, (_core.model_to_bytes(model),)))
copyreg.pickle(Scene, lambda scene: (_restored_scene, (_core.scene_to_bytes(scene),)))
