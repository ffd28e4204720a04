"""Many instances of one model in time."""

from __future__ import annotations

import difflib
import os
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from . import _core
from ._core import Model, Observed, Scene
from .errors import InputError, name_list, whole_number
from .scenes import Settings, made_scene

# What a batch takes in by rows, and which names of `set` are columns of it.
ROWS = ("targets", "forces", "gains", "friction", "ground_friction", "gravity")
COLUMNS = {"target": "targets", "force": "forces", "gain": "gains", "friction": "friction"}


class Batch:
    """N instances of one model in time, over the lanes of the processor's registers and all threads.

    model: a Model, a Scene, or the name of a file or generated model. instances: how many. observe: what `observations` holds of each after
    every step, by name:

        q, v, a, p          positions, velocities, accelerations, momenta of all joints; of joint J with its name behind a colon: q:J
        targets, target:J   of all servos, of that of joint J
        time, energy        energy: kinetic, potential
        com, com_velocity, momentum
        pose:L, position:L, quaternion:L, twist:L, acceleration:L, imu:L    of link L
        contact:L                                                           places that ground or bodies push, normal force

    threads: 0 for all there are. instructions: "avx512", "avx2", "baseline" or "scalar"; the best there are where it is None. dtype:
    float64, or float32 for half the memory and up to twice the speed (on the ground it takes more evaluations, and more time than float64).
    observation_dtype: of `observations`, as dtype where it is None. settings: as linden.scene has them, beside a Model.

    Instances begin where the scene does, all alike; of what the scene randomises, instance i has what the seed scene.seed + i draws.
    Starts that differ are drawn by reset(seed=..., spread=...), as `linden rollout --seed --spread` draws them. An instance whose step
    fails is frozen in its last good state (`failed`, `status`, `describe`). Results do not depend on threads, on company or on how steps
    are split into calls; with other instructions they differ by rounding. It can be pickled and copied, and goes on equal to the bit.

    Arrays in and out. `observations` is one array that step writes, and `targets`, `forces`, `gains`, `friction`, `ground_friction` and
    `gravity` are arrays that step reads: write into them at will, also by way of DLPack; the threads carry the numbers to and from the
    state. `q`, `v`, `energy`, `status` and the other counts are arrays of the moment, computed when they are asked for. Where the state
    itself lies, instances that are computed together lie together: q_blocks and p_blocks see it so, without a copy.
    """

    def __init__(
        self,
        model: Model | Scene | str | os.PathLike[str],
        instances: int,
        *,
        observe: Sequence[str] = (),
        threads: int = 0,
        instructions: str | None = None,
        dtype: DTypeLike = np.float64,
        observation_dtype: DTypeLike | None = None,
        **settings: Unpack[Settings],
    ) -> None:
        scene = made_scene(model, settings, 2)
        instances, threads, names = whole_number("instances", instances), whole_number("threads", threads), name_list("observe", observe)
        self._dtype = _precision("dtype", dtype)
        self._observation_dtype = _precision("observation_dtype", dtype if observation_dtype is None else observation_dtype)
        core = _core.Batch64 if self._dtype == np.float64 else _core.Batch32
        self._threads, self._instructions = threads, instructions
        self._core: Any = core(scene, instances, threads, instructions, names)
        self._rows: dict[str, NDArray[Any]] = {}
        self._observations: NDArray[Any] = np.zeros((instances, self._core.width), self._observation_dtype)
        self._layout = {entry.name: entry for entry in self._core.layout}
        self._observe()

    # -- what it is

    @property
    def scene(self) -> Scene:
        return self._core.scene  # type: ignore[no-any-return]

    @property
    def model(self) -> Model:
        return self.scene.model

    def __len__(self) -> int:
        return self._core.size  # type: ignore[no-any-return]

    @property
    def instances(self) -> int:
        """N."""
        return len(self)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of what is computed and of the arrays that are taken in."""
        return self._dtype

    @property
    def lanes(self) -> int:
        """Instances that are computed together."""
        return self._core.lanes  # type: ignore[no-any-return]

    @property
    def threads(self) -> int:
        return self._core.threads  # type: ignore[no-any-return]

    @property
    def instructions(self) -> str:
        return self._core.instructions  # type: ignore[no-any-return]

    @property
    def nbytes(self) -> int:
        """Memory of all that is kept of the instances."""
        held = self._core.nbytes + sum(rows.nbytes for rows in self._rows.values())
        return held + self._observations.nbytes  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f'<linden.Batch of {len(self)} "{self.model.name}", {self.instructions}, {self.threads} threads>'

    # -- in and out

    @property
    def observations(self) -> NDArray[Any]:
        """What was asked for of every instance [N, width], as it is after the last step, reset or load: the same array always."""
        return self._observations

    @property
    def layout(self) -> dict[str, Observed]:
        """By name: its columns in `observations` (`slice`), what each is called (`rows`), units."""
        return self._layout

    @property
    def targets(self) -> NDArray[Any]:
        """Where servos drive their joints [N, servos; rad, m], in the order of scene.servos. A servo whose target is a table has NaN
        until a number is written, which then goes over the table; NaN gives it back."""
        return self._rows_of("targets")

    @targets.setter
    def targets(self, value: ArrayLike) -> None:
        self._write_rows("targets", value)

    @property
    def forces(self) -> NDArray[Any]:
        """Generalized forces on top of all that acts [N, nv; N m, N]."""
        return self._rows_of("forces")

    @forces.setter
    def forces(self, value: ArrayLike) -> None:
        self._write_rows("forces", value)

    @property
    def gains(self) -> NDArray[Any]:
        """Factors of the servos' stiffness and damping [N, servos]; none negative."""
        return self._rows_of("gains")

    @gains.setter
    def gains(self, value: ArrayLike) -> None:
        self._write_rows("gains", value)

    @property
    def friction(self) -> NDArray[Any]:
        """Forces of joint friction [N, joints with friction; N m, N], in the order of scene.rubbing_joints; none negative."""
        return self._rows_of("friction")

    @friction.setter
    def friction(self, value: ArrayLike) -> None:
        self._write_rows("friction", value)

    @property
    def ground_friction(self) -> NDArray[Any]:
        """Coulomb's coefficient of the ground [N, 1]; not negative."""
        return self._rows_of("ground_friction")

    @ground_friction.setter
    def ground_friction(self, value: ArrayLike) -> None:
        self._write_rows("ground_friction", value)

    @property
    def gravity(self) -> NDArray[Any]:
        """[N, 3; m/s^2], world frame."""
        return self._rows_of("gravity")

    @gravity.setter
    def gravity(self, value: ArrayLike) -> None:
        self._write_rows("gravity", value)

    # -- in time

    def step(self, n: int = 1) -> None:
        """n steps of every instance that is not frozen. Raises InputError, before the first, where a row that was written makes no sense;
        KeyboardInterrupt ends it between two steps."""
        rows = self._rows
        seen = self._observations if self._observations.size else None
        self._core.step(whole_number("n", n), *[rows.get(name) for name in ROWS], seen)

    def reset(
        self,
        which: ArrayLike | None = None,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        *,
        seed: int | ArrayLike | None = None,
        spread: float = 0.0,
    ) -> None:
        """Instances begin again, frozen ones too: all, or those of a mask [N] or of a list.

        q, v: where and how fast, one row for all or one for each; the scene's start and rest where they are None. seed: draws anew what
        the scene randomises, for instance i by seed + i, or by its own of an array with one for each of `which`; and with a spread moves
        positions of joints and all velocities by uniform numbers up to it [rad, m, per s], within limits. What else was set of an instance
        (targets, forces, masses, ...) stays, and rows that were written are taken in as by a step.
        """
        chosen = self._chosen(which)
        starts = self._rows_for(chosen, "q", q, self.model.nq, self.scene.q)
        rates = self._rows_for(chosen, "v", v, self.model.nv, self.scene.v)
        if spread != 0.0 and seed is None:
            raise InputError("spread: given without a seed; expected both, or none")
        # what was written into the rows is the batch's before some of it is drawn anew, and before all is seen
        self._core.step(0, *[self._rows.get(name) for name in ROWS], None)
        if seed is not None:
            for part, number in self._seeds(chosen, seed):
                self._core.draw(chosen[part], number)
                self._core.scatter(chosen[part], number, spread, starts[part], rates[part])
            self._read_rows()
        self._core.reset(chosen, starts, rates)
        self._observe()

    # -- as it is now

    @property
    def q(self) -> NDArray[Any]:
        """Positions [N, nq]."""
        return self.ask(["q"])

    @property
    def v(self) -> NDArray[Any]:
        """Velocities of the motion [N, nv]."""
        return self.ask(["v"])

    @property
    def energy(self) -> NDArray[Any]:
        """Kinetic and potential [N, 2; J]."""
        return self.ask(["energy"])

    @property
    def q_blocks(self) -> NDArray[Any]:
        """Positions where they lie [blocks, lanes, nq]: instance i is lane i % lanes of block i // lanes. Not to be written into; lanes
        of the last block may hold no instance."""
        return self._core.blocks("q")  # type: ignore[no-any-return]

    @property
    def p_blocks(self) -> NDArray[Any]:
        """Discrete momenta, likewise [blocks, lanes, nv]."""
        return self._core.blocks("p")  # type: ignore[no-any-return]

    def ask(self, names: Sequence[str]) -> NDArray[Any]:
        """What is asked for by name of every instance now, beside what `observe` named [N, width]."""
        return self._core.ask(name_list("names", names), self._dtype == np.float32)  # type: ignore[no-any-return]

    @property
    def status(self) -> NDArray[np.uint8]:
        """How the last step of every instance went: linden.Status as numbers [N]."""
        return self._core.status  # type: ignore[no-any-return]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which instances are frozen [N]."""
        return np.not_equal(self.status, 0)

    def describe(self, instance: int) -> str:
        """What froze an instance, in a sentence; empty where it runs."""
        return self._core.describe(instance)  # type: ignore[no-any-return]

    @property
    def steps(self) -> NDArray[np.int64]:
        """Taken since the start or the last reset [N]."""
        return self._core.steps  # type: ignore[no-any-return]

    @property
    def evaluations(self) -> NDArray[np.int64]:
        """Of the residual, likewise [N]."""
        return self._core.evaluations  # type: ignore[no-any-return]

    @property
    def rescued(self) -> NDArray[np.int32]:
        """Steps that were taken alone, split, backtracked or with bodies near each other, likewise [N]."""
        return self._core.rescued  # type: ignore[no-any-return]

    # -- what differs from instance to instance

    def set(self, name: str, values: ArrayLike, which: ArrayLike | None = None) -> None:
        """A parameter of some instances by name, one value for all of them or one for each:

            mass:L                 of the body that link L is part of [kg], its inertia in proportion
            inertia:L              m, m c (3), xx xy xz yy yz zz about the body's origin [10; kg, kg m, kg m^2]
            friction:J, gain:J, target:J, force:J     of joint J, a column of `friction`, `gains`, `targets`, `forces`
            ground_friction, gravity                  columns of these

        Masses keep positions and momenta: set them before a reset.
        """
        chosen = self._chosen(which)
        kind, _, subject = name.partition(":")
        if kind == "mass":
            self._core.set_masses(chosen, subject, self._values(name, values, (len(chosen),)))
        elif kind == "inertia":
            self._core.set_inertias(chosen, subject, self._values(name, values, (len(chosen), 10)))
        else:
            rows, columns = self._columns(name)
            rows[chosen, columns] = self._values(name, values, rows[chosen, columns].shape)

    def get(self, name: str) -> NDArray[Any]:
        """A parameter of all instances, by the names of `set`."""
        kind, _, subject = name.partition(":")
        if kind == "mass":
            return self._core.masses(subject)  # type: ignore[no-any-return]
        if kind == "inertia":
            return self._core.inertias(subject)  # type: ignore[no-any-return]
        rows, columns = self._columns(name)
        return rows[:, columns].copy()

    # -- kept

    def save(self, file: str | os.PathLike[str]) -> None:
        """All that the run depends on, into a file: one that goes on from it is equal to the bit, by other instructions to rounding."""
        self.step(0)
        self._core.save(os.fspath(file))

    def load(self, file: str | os.PathLike[str]) -> None:
        """What was saved of a batch of the same scene and size. Raises InputError, and changes nothing, for anything else."""
        self._core.load(os.fspath(file))
        self._read_rows()
        self._observe()

    def checkpoint(self) -> bytes:
        """What save writes, as bytes."""
        self.step(0)
        return self._core.checkpoint()  # type: ignore[no-any-return]

    def restore(self, checkpoint: bytes) -> None:
        """What checkpoint() gave of a batch of the same scene and size."""
        self._core.restore(checkpoint)
        self._read_rows()
        self._observe()

    def __reduce__(self) -> tuple[Any, ...]:
        made = (self.scene, len(self), list(self._layout), self._threads, self._instructions, self._dtype, self._observation_dtype)
        return _restored, (*made, list(self._rows), self.checkpoint())

    # -- within

    def _read_rows(self) -> None:
        for name, rows in self._rows.items():
            rows[...] = self._core.rows(name)

    def _observe(self) -> None:
        if self._observations.size:
            self._core.observe(self._observations)

    def _rows_of(self, name: str) -> NDArray[Any]:
        if name not in self._rows:
            self._rows[name] = np.array(self._core.rows(name), self._dtype)
        return self._rows[name]

    def _write_rows(self, name: str, value: ArrayLike) -> None:
        rows = self._rows_of(name)
        rows[...] = self._values(name, value, rows.shape)

    def _columns(self, name: str) -> tuple[NDArray[Any], int | slice]:
        kind, colon, joint = name.partition(":")
        if not colon and name in ("ground_friction", "gravity"):
            return self._rows_of(name), 0 if name == "ground_friction" else slice(None)
        if kind not in COLUMNS or not colon:
            near = difflib.get_close_matches(kind, ["mass", "inertia", *COLUMNS, "ground_friction", "gravity"], 1)
            raise InputError(
                f'parameter "{name}" is not known; expected mass:LINK, inertia:LINK, friction:JOINT, gain:JOINT, target:JOINT, '
                f"force:JOINT, ground_friction or gravity{f'; did you mean {near[0]}?' if near else ''}"
            )
        return self._rows_of(COLUMNS[kind]), self._core.column(COLUMNS[kind], joint)

    def _chosen(self, which: ArrayLike | None) -> NDArray[np.int64]:
        if which is None:
            return np.arange(len(self), dtype=np.int64)
        chosen = np.asarray(which)
        if chosen.dtype == np.bool_:
            if chosen.shape != (len(self),):
                raise InputError(f"which: a mask of shape {list(chosen.shape)} is given; expected one of shape [{len(self)}]")
            return np.flatnonzero(chosen).astype(np.int64)
        if chosen.size and not np.issubdtype(chosen.dtype, np.integer):
            raise InputError(f"which: numbers of type {chosen.dtype} are given; expected whole numbers of instances, or a mask")
        beyond = chosen[(chosen < 0) | (chosen >= len(self))]
        if beyond.size:
            raise InputError(f"which: there is no instance {beyond.flat[0]}; they go from 0 to {len(self) - 1}")
        return np.ascontiguousarray(chosen.reshape(-1), np.int64)

    @staticmethod
    def _seeds(chosen: NDArray[np.int64], seed: int | ArrayLike) -> list[tuple[slice, int]]:
        """Parts of `chosen`, and the number to which the core adds an instance's own for its seed."""
        seeds = np.asarray(seed)
        if not np.issubdtype(seeds.dtype, np.integer) or seeds.shape not in ((), chosen.shape) or (seeds < 0).any():
            raise InputError(
                f"seed: {seeds.dtype} of shape {list(seeds.shape)} is given; expected a whole number, zero or more, or one for each "
                f"instance, shape [{len(chosen)}]"
            )
        if seeds.ndim == 0:
            return [(slice(None), int(seeds))]
        return [(slice(k, k + 1), (int(seeds[k]) - int(i)) % 2**64) for k, i in enumerate(chosen)]

    def _rows_for(
        self, chosen: NDArray[np.int64], name: str, value: ArrayLike | None, count: int, usual: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        rows = self._values(name, usual if value is None else value, (len(chosen), count))
        wrong = np.argwhere(~np.isfinite(rows))
        if wrong.size:
            k, row = wrong[0]
            names = self.model.q_names if name == "q" else self.model.v_names
            raise InputError(
                f'{name}: "{names[row]}" of instance {chosen[k]} is {rows[k, row]}; expected a finite number; nothing was reset'
            )
        return rows

    @staticmethod
    def _values(name: str, value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """A copy of its own, spread over the shape."""
        try:
            given = np.asarray(value, np.float64)
            return np.array(np.broadcast_to(given, shape), order="C")  # row after row, as the core writes into it
        except (TypeError, ValueError) as error:
            raise InputError(f"{name}: {error}; expected numbers of shape {list(shape)}, or of one row for all") from None


def _precision(name: str, dtype: DTypeLike) -> np.dtype[Any]:
    found = np.dtype(dtype)
    if found not in (np.dtype(np.float64), np.dtype(np.float32)):
        raise InputError(f"{name}: {found} is given; expected float64 or float32")
    return found


def _restored(
    scene: Scene,
    instances: int,
    observe: list[str],
    threads: int,
    instructions: str | None,
    dtype: np.dtype[Any],
    observation_dtype: np.dtype[Any],
    rows: list[str],
    checkpoint: bytes,
) -> Batch:
    batch = Batch(
        scene,
        instances,
        observe=observe,
        threads=threads,
        instructions=instructions,
        dtype=dtype,
        observation_dtype=observation_dtype,
    )
    batch.restore(checkpoint)
    for name in rows:
        batch._rows_of(name)
    return batch
