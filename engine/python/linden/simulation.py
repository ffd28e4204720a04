"""One instance in time."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import CentreOfMass, LinkDistance, Model, NearPair, Pose, Proximity, Scene
from .errors import InputError, name_list
from .scenes import Settings, made_scene
from .views import View, motion_of


class Simulation(_core.Simulation):
    """One instance of a model in time: state, step, energy, questions, checkpoint.

    model: a Model, a Scene, or the name of a file or generated model. settings: as linden.scene has them, beside a Model; with the keys of
    a scene's file. It begins where the scene does: at rest in the zero configuration where nothing else is said.

    Arrays that it gives are those of the moment and cannot be written into: assign `sim.q`, not `sim.q[3]`. A thread at a time may use it;
    others run meanwhile. It can be pickled and copied, and goes on equal to the bit.
    """

    def __init__(self, model: Model | Scene | str | os.PathLike[str], **settings: Unpack[Settings]) -> None:
        super().__init__(made_scene(model, settings, 2))
        self._observations: dict[tuple[str, ...], _core.Observations] = {}
        self._shapes: Proximity | None = None

    # what is asked most, of the state as it is now; more can be asked of kinematics()
    def pose(self, link: str) -> Pose:
        """Where a link is. Any link of the robot's file; an unknown one is an InputError with the nearest name, here and below."""
        return self._kinematics.pose(link)

    def twist(self, link: str, frame: str = "aligned") -> NDArray[np.float64]:
        """Angular and linear velocity of a link's origin, in the directions of the world ("aligned"), or as frame says [6; rad/s, m/s]."""
        return self._kinematics.twist(link, frame)

    def acceleration(self, link: str, frame: str = "aligned") -> NDArray[np.float64]:
        """Angular acceleration and that of the link's origin [6; rad/s^2, m/s^2]."""
        return self._kinematics.acceleration(link, frame)

    def imu(self, link: str) -> NDArray[np.float64]:
        """What an IMU on a link reads: angular velocity and specific force, in the link's frame [6; rad/s, m/s^2]."""
        return self._kinematics.imu(link)

    def jacobian(self, link: str, frame: str = "aligned") -> NDArray[np.float64]:
        """J [6, nv]: J v is the link's twist in that frame, "aligned", "link" or "world"."""
        return self._kinematics.jacobian(link, frame)

    def mass_matrix(self) -> NDArray[np.float64]:
        """M(q) [nv, nv]."""
        return self._kinematics.mass_matrix()

    def bias_forces(self) -> NDArray[np.float64]:
        """Coriolis, centrifugal and gyroscopic forces, less gravity's [nv]."""
        return self._kinematics.bias_forces()

    def inverse_dynamics(self, a: ArrayLike) -> NDArray[np.float64]:
        """Joint forces [nv] that give the state accelerations a [nv], gravity acting as it does."""
        now = self.kinematics()
        now.set(now.q, now.v, a)
        return now.inverse_dynamics()

    @property
    def _proximity(self) -> Proximity:
        if self._shapes is None:
            self._shapes = Proximity(self.model)
        return self._shapes

    def distance(self, link_a: str, link_b: str) -> LinkDistance:
        """How far the collision shapes of two links are apart, and along which direction; meshes are their convex hulls.

        The meshes are read when it is first asked. An unknown link and one without a collision shape are an InputError.
        """
        return self._proximity.distance(self._kinematics, link_a, link_b)

    def near(self, margin: float) -> list[NearPair]:
        """All pairs of collision shapes no farther apart than the margin [m], with the points where they meet; neighbours are left out.

        With pairs of an SRDF file left out too: linden.Proximity(model, linden.srdf_disabled_pairs(file)).near(sim.kinematics(), margin).
        """
        return self._proximity.near(self._kinematics, margin)

    @property
    def centre_of_mass(self) -> CentreOfMass:
        """Its position and velocity, and the mass of all that moves."""
        return self._kinematics.centre_of_mass

    def observe(self, names: Sequence[str], out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """A row of what is asked for by name, such as ["q", "v", "pose:hand", "com"]; all names: linden.Batch.

        out: where to write it [width]. The list is made ready when it is first asked for.
        """
        key = tuple(name_list("names", names))
        seen = self._observations.get(key)
        if seen is None:
            seen = self._observations[key] = _core.Observations(self, list(key))
        if out is None:
            out = np.empty(seen.width)
        seen.observe(self, out)
        return out

    def record(self, steps: int, names: Sequence[str], every: int = 1) -> dict[str, NDArray[np.float64]]:
        """Runs so many steps and keeps what is asked for by name, at the start and after every `every` steps: {name: [frames, width]}."""
        if steps < 0:
            raise InputError(f"steps: {steps} are asked for; expected zero or more")
        if every < 1:
            raise InputError(f"every: {every} is given; expected one step or more")
        seen = _core.Observations(self, name_list("names", names))
        frames = np.empty((steps // every + 1, seen.width))
        seen.observe(self, frames[0])
        for frame in frames[1:]:
            self.run(every)
            seen.observe(self, frame)
        self.run(steps % every)
        return {entry.name: frames[:, entry.slice] for entry in seen.entries}

    def view(self, duration: float = 0.0, fps: float = 60.0) -> View:
        """The page that shows the simulation: the state as it is, or how it goes on for a duration [s].

        A copy goes on, so that the simulation stays where it is. In a notebook the page appears where this is the last line of a cell; it
        can be saved as .html or .glb. fps: frames that are kept of a second.
        """
        return motion_of(copy.copy(self), duration, fps)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (type(self), self.scene, self.checkpoint())


def _restored(kind: type[Simulation], scene: Scene, checkpoint: bytes) -> Simulation:
    simulation = kind(scene)
    simulation.restore(checkpoint)
    return simulation
