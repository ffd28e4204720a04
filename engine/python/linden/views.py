"""Motions to be looked at: in a notebook, in a browser, in Blender."""

from __future__ import annotations

import html
import math
import os
import pathlib
import tempfile
import warnings
import webbrowser
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Model, Scene
from .errors import InputError, InputWarning
from .scenes import Settings, made_scene

if TYPE_CHECKING:
    from .simulation import Simulation

MOST_POSES = 6_000_000  # of bodies in all frames; engine/view/animation_recorder.cpp


class View:
    """A motion that can be looked at: shown by a notebook, saved as a page or as glTF, opened in a browser.

    page: the whole HTML file, which needs no network.
    """

    def __init__(self, recorder: _core.AnimationRecorder) -> None:
        self._recorder = recorder
        self._page: str | None = None
        for warning in recorder.warnings:
            warnings.warn(warning, InputWarning, stacklevel=3)

    @property
    def page(self) -> str:
        if self._page is None:
            self._page = self._recorder.page()
        return self._page

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes FILE.html, or FILE.glb (binary glTF 2.0, for Blender and others)."""
        path = pathlib.Path(file)
        if path.suffix == ".html":
            path.write_text(self.page, encoding="utf-8")
        elif path.suffix == ".glb":
            path.write_bytes(self._recorder.gltf())
        else:
            raise InputError(f'{path}: the file\'s name ends in "{path.suffix}"; expected .html or .glb')

    def open(self) -> None:
        """Shows it in the browser that this machine opens pages with."""
        with tempfile.NamedTemporaryFile("w", suffix=".html", prefix="linden-", delete=False, encoding="utf-8") as file:
            file.write(self.page)
        webbrowser.open(pathlib.Path(file.name).as_uri())

    def _repr_html_(self) -> str:
        # a document of its own: its styles are not the notebook's
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" style="width:100%;height:560px;border:0" sandbox="allow-scripts" '
            'title="linden"></iframe>'
        )


def view(
    what: Model | Scene | str | os.PathLike[str] | ArrayLike,
    model: Model | Scene | str | os.PathLike[str] | None = None,
    times: ArrayLike | None = None,
    fps: float = 60.0,
    shown: int = 16,
    **settings: Unpack[Settings],
) -> View:
    """The page that shows a model in its start, a recording, or positions.

    what: a model or scene, or the name of one; FILE.npz as linden records it; or positions [frames, nq] or [frames, instances, nq].
    model: what a recording or positions are of, a model or scene or the name of one. times: of positions [frames, s]; 1/fps apart where
    they are not given. shown: instances at most, from the first on. settings: as linden.scene has them, for a model.
    Throws InputError for positions that are not of the model, and for numbers that are not finite.
    """
    recording = isinstance(what, (str, os.PathLike)) and pathlib.Path(what).suffix == ".npz"
    if isinstance(what, (Model, Scene)) or (isinstance(what, (str, os.PathLike)) and not recording):
        if model is not None:
            raise InputError("model: what is shown is a model itself; expected model beside a recording or positions; leave it out")
        scene = made_scene(what, settings, 2)
        recorder = _core.AnimationRecorder(scene, scene.model.name)
        recorder.add(0.0, np.asarray(_core.Simulation(scene).q)[None])
        return View(recorder)
    if model is None:
        raise InputError("model: positions and recordings are of a model; expected the model, or the name of its file")
    scene = made_scene(model, settings, 2)
    if recording:
        assert isinstance(what, (str, os.PathLike))
        q, times = _recorded(what, scene)
    else:
        q = np.asarray(what, dtype=float)
    if q.ndim == 2:
        q = q[:, None]
    nq = len(scene.model.q_names)
    if q.ndim != 3 or q.shape[2] != nq or q.shape[0] == 0:
        raise InputError(f"q: an array of shape {q.shape} was given; expected [frames, {nq}] or [frames, instances, {nq}]")
    when = np.arange(len(q)) / fps if times is None else np.asarray(times, dtype=float)
    if when.shape != (len(q),) or not np.all(np.isfinite(when)) or np.any(np.diff(when) <= 0):
        raise InputError(f"times: shape {when.shape} was given; expected {len(q)} finite times, each above the one before")
    count = min(shown, q.shape[1])
    recorder = _core.AnimationRecorder(scene, scene.model.name, count)
    if count < q.shape[1]:
        recorder.note(f"the first {count} of {q.shape[1]} instances")
    for k in _kept(when, fps, count * len(scene.model.bodies)):
        recorder.add(when[k] - when[0], np.ascontiguousarray(q[k, :count]))
    return View(recorder)


def motion_of(simulation: Simulation, duration: float, fps: float) -> View:
    """How a simulation goes on, from a frame of its state now."""
    if not (math.isfinite(duration) and duration >= 0):
        raise InputError(f"duration: {duration} is given; expected seconds, zero or more")
    if not (math.isfinite(fps) and fps > 0):
        raise InputError(f"fps: {fps} is given; expected frames a second, above zero")
    scene = simulation.scene
    recorder = _core.AnimationRecorder(scene, scene.model.name)
    begin = simulation.time
    simulation.keep_forces()
    recorder.add_simulation(0.0, simulation)
    steps = round(duration / scene.step)
    stride = max(1, round(1 / (fps * scene.step)), math.ceil(steps * len(scene.model.bodies) / MOST_POSES))
    if simulation.step_lengths is not None:  # frames are the ends of steps that vary
        for frame in range(stride, steps + stride, stride):
            before = simulation.time
            simulation.advance_to(begin + min(frame, steps) * scene.step)
            if simulation.time > before:
                recorder.add_simulation(simulation.time - begin, simulation)
        return View(recorder)
    while steps > 0:
        simulation.run(min(stride, steps))
        steps -= stride
        recorder.add_simulation(simulation.time - begin, simulation)
    return View(recorder)


def _recorded(file: str | os.PathLike[str], scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    with np.load(file) as data:
        for name in ("q", "time", "positions"):
            if name not in data:
                raise InputError(f'{os.fspath(file)}: there is no array "{name}"; expected what linden recorded of {scene.model.name}')
        names = list(data["positions"])
        missing = [name for name in scene.model.q_names if name not in names]
        if missing:
            raise InputError(f'{os.fspath(file)}: position "{missing[0]}" of the model is not in it; give the model that was recorded')
        return data["q"][:, :, [names.index(name) for name in scene.model.q_names]].astype(float), data["time"]


def _kept(times: NDArray[np.float64], fps: float, poses: int) -> list[int]:
    """Frames at most 1/fps apart on average, and no more than can be shown; the last one among them."""
    if len(times) == 1:
        return [0]
    step = (times[-1] - times[0]) / (len(times) - 1)
    stride = max(1, round(1 / (fps * step)), math.ceil((len(times) - 1) * poses / MOST_POSES))
    kept = list(range(0, len(times), stride))
    return kept if kept[-1] == len(times) - 1 else [*kept, len(times) - 1]
