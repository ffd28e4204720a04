"""Gymnasium's environments over a Batch.

    import linden.gym

    env = linden.gym.VectorEnv(
        "models/scenes/humanoid_drop.yaml", 256, observe=["q", "v"], watch=["position:pelvis"], frame_skip=20, max_episode_steps=500,
        reward=lambda seen, actions: seen["position:pelvis"][:, 2],
        terminated=lambda seen, actions: seen["position:pelvis"][:, 2] < 0.5)
    observations, infos = env.reset(seed=1)
    observations, rewards, terminated, truncated, infos = env.step(env.action_space.sample())

This module alone needs Gymnasium, 1.1 or newer.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

try:
    import gymnasium
    from gymnasium.utils import seeding
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ImportError:
    raise ImportError("linden.gym needs Gymnasium 1.1 or newer, which is not there; install it: pip install gymnasium")

from ._core import Scene
from .batch import Batch
from .errors import InputError
from .scenes import load_scene

__all__ = ["AutoresetMode", "Env", "Rule", "Seen", "VectorEnv"]

# An episode's seed, which its instance's generator draws, is below this.
SEEDS = 2**63


class Seen(dict[str, NDArray[Any]]):
    """Observations by name: of each its columns of `batch.observations` [N, width], live and not to be written into."""

    def __missing__(self, name: str) -> NDArray[Any]:
        near = difflib.get_close_matches(str(name), self, 1)
        hint = f'; did you mean "{near[0]}"?' if near else ""
        raise InputError(f'"{name}" is not observed; expected one of {", ".join(self)}, or that `observe` or `watch` names it{hint}')


Rule = Callable[[Seen, NDArray[Any]], ArrayLike]
"""(what is seen of all instances, actions [N, actions]) -> one number, or truth, for each instance [N]."""


class VectorEnv(gymnasium.vector.VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """N instances of a scene as a vector environment of Gymnasium: no Python runs between their steps.

    source: a Scene, the name of its file, or a Batch, which the environment then steps and resets. num_envs: N, where it is not a Batch.
    observe: what the agent sees, in this order, with the names of Batch; of a Batch all that it observes where it is None. watch: what
    reward and termination see besides. reward, terminated: functions of arrays, called once a step with what all instances have come to
    and with the actions that led there; they give [N] numbers, and [N] truths. Where terminated is None, nothing terminates.

    actions: what the agent sets, with the names of Batch.set: "targets" for those of all servos, or a list of target:J and force:J.
    An action is held through the step. scaled: actions go from -1 to 1, which stands for the range of each; else they are given
    in its units [rad, m; N m, N]. The range is that of the joint's position or effort in the robot's file, or of `ranges`:
    {"target:J": (lowest, highest), ...}. Actions beyond the space count as its border.

    frame_skip: steps of the batch that make one of the environment. max_episode_steps: truncates episodes of so many of the latter.
    spread: how far starts are drawn about that of the scene, as Batch.reset has it; what the scene randomises is drawn for each episode
    too.
    copy: observations are copies, which stay as they are; else they are views of `batch.observations` that each step writes over (where the
    columns of `observe` do not lie together, they are copies always). Rewards, terminations, truncations and infos are new arrays always.
    threads, instructions, dtype, observation_dtype: of the batch that is made; a Batch that is given has its own.

    Seeds: reset(seed=s) gives instance i a generator of its own with the seed s + i, which draws the seed of each of its episodes. An
    episode depends on it alone, not on company, threads or what came before; `infos["seed"]` says it after every reset, and
    batch.reset([i], seed=[it], spread=spread) begins that episode again. reset(options={"reset_mask": mask}) resets those of a mask [N].
    A new episode finds targets and forces that are actions as they were when the environment was made; what else was set of an instance
    stays.

    An instance whose step fails is truncated: it is seen in its last good state, and `infos["failure"]` is the reason in a sentence.
    What is over begins anew as `autoreset_mode` says: in the next step, with a reward of 0; in the same step, with `infos["final_obs"]` and
    `infos["final_info"]`; or not by itself. A step of an instance that has not begun, or is over and does not begin anew by itself, raises
    gymnasium.error.ResetNeeded. Other errors are InputErrors.
    """

    def __init__(
        self,
        source: Batch | Scene | str | os.PathLike[str],
        num_envs: int | None = None,
        *,
        reward: Rule,
        terminated: Rule | None = None,
        observe: Sequence[str] | None = None,
        watch: Sequence[str] = (),
        actions: str | Sequence[str] = "targets",
        scaled: bool = True,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        frame_skip: int = 1,
        max_episode_steps: int | None = None,
        spread: float = 0.0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int = 0,
        instructions: str | None = None,
        dtype: DTypeLike = np.float64,
        observation_dtype: DTypeLike = np.float32,
    ) -> None:
        super().__init__()
        self.frame_skip = _count("frame_skip", frame_skip)
        self.max_episode_steps = None if max_episode_steps is None else _count("max_episode_steps", max_episode_steps)
        self.spread = float(spread)
        self.copy = copy
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {"autoreset_mode": self.autoreset_mode, "render_modes": []}
        self._reward, self._terminated = reward, terminated

        if isinstance(source, Batch):
            if num_envs not in (None, len(source)):
                raise InputError(f"num_envs: {num_envs} is given beside a batch of {len(source)} instances; expected none, or the same")
            self.batch = source
        else:
            scene = source if isinstance(source, Scene) else load_scene(source)
            names = list(dict.fromkeys([*(observe or ()), *watch]))
            self.batch = Batch(
                scene, _count("num_envs", num_envs), observe=names, threads=threads, instructions=instructions, dtype=dtype,
                observation_dtype=observation_dtype,
            )
        self.num_envs = len(self.batch)
        rows = self.batch.observations
        self._seen = Seen({name: rows[:, entry.slice] for name, entry in self.batch.layout.items()})
        for name in watch:
            self._seen[name]  # raises where it is not observed
        if observe is None:
            observe = list(self._seen) if isinstance(source, Batch) else ()
        self._columns, width = self._columns_of(observe)
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (width,), rows.dtype.type)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._drives = _Drives(self.batch, actions, dict(ranges or {}), scaled)
        self.single_action_space = gymnasium.spaces.Box(self._drives.low, self._drives.high, dtype=np.float32)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

        self._generators: list[np.random.Generator | None] = [None] * self.num_envs
        self._begun = np.zeros(self.num_envs, np.bool_)  # were reset once at least
        self._running = np.zeros(self.num_envs, np.bool_)  # in an episode that is not over
        self._elapsed = np.zeros(self.num_envs, np.int64)  # steps of it

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """New episodes of all instances, or of options["reset_mask"] [N, bool]. seed: s gives instance i the generator of s + i; or a list
        of one for each instance, None for those that keep theirs. Returns observations [N, width] of all, and infos with the episodes'
        seeds."""
        which = np.flatnonzero(self._mask(options))
        if seed is not None:
            self._seed(which, seed)
            super().reset(seed=seed if isinstance(seed, int) else None)
        infos = self._begin(which)
        return self._observations(), infos

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """frame_skip steps of the batch under actions [N, actions]. Returns observations [N, width], rewards, terminations and truncations
        [N], infos."""
        over = ~self._running
        next_step = self.autoreset_mode == AutoresetMode.NEXT_STEP
        waiting = ~self._begun if next_step else over
        if waiting.any():
            some = ", ".join(str(i) for i in np.flatnonzero(waiting)[:5])
            raise gymnasium.error.ResetNeeded(
                f"step: {waiting.sum()} of {self.num_envs} instances, such as {some}, are over or have not begun; "
                'reset them first, alone with options={"reset_mask": mask}'
            )
        applied = self._drives.write(actions)
        self.batch.step(self.frame_skip)
        self._elapsed += 1

        rewards = self._judge("reward", self._reward, applied, np.float64)
        terminated = np.zeros(self.num_envs, np.bool_)
        if self._terminated is not None:
            terminated = self._judge("terminated", self._terminated, applied, np.bool_)
        truncated = self.batch.failed
        infos = self._reasons(truncated & ~over)
        if self.max_episode_steps is not None:
            truncated |= self._elapsed >= self.max_episode_steps
        # instances that were over went along with the batch; what they came to counts for nothing
        rewards[over], terminated[over], truncated[over] = 0.0, False, False
        ended = terminated | truncated
        self._running &= ~ended

        if self.autoreset_mode == AutoresetMode.SAME_STEP and ended.any():
            infos = {**self._final(ended, infos), **self._begin(np.flatnonzero(ended))}
        elif next_step and over.any():
            infos.update(self._begin(np.flatnonzero(over)))
        return self._observations(), rewards, terminated, truncated, infos

    # -- within

    def _columns_of(self, names: Sequence[str]) -> tuple[slice | NDArray[np.int64], int]:
        """Where the names lie in `batch.observations`, a slice where they lie together; and how many numbers they are."""
        layout = {name: self.batch.layout[name] for name in names if self._seen[name].shape[1] > 0}
        columns = np.array([k for entry in layout.values() for k in range(entry.offset, entry.offset + entry.width)], np.int64)
        if columns.size == 0:
            raise InputError('observe: nothing is named; expected one name or more of what an agent can see, such as ["q", "v"]')
        together = np.array_equal(columns, np.arange(columns[0], columns[0] + columns.size))
        return slice(int(columns[0]), int(columns[-1]) + 1) if together else columns, int(columns.size)

    def _begin(self, which: NDArray[np.int64]) -> dict[str, Any]:
        seeds = np.zeros(self.num_envs, np.int64)
        for i in which:
            generator = self._generators[i]
            if generator is None:
                generator = self._generators[i] = seeding.np_random()[0]
            seeds[i] = generator.integers(SEEDS)
        self._drives.release(which)
        self.batch.reset(which, seed=seeds[which], spread=self.spread)
        self._elapsed[which] = 0
        self._begun[which] = True
        self._running[which] = True
        begun = np.zeros(self.num_envs, np.bool_)
        begun[which] = True
        return {"seed": seeds, "_seed": begun}

    def _seed(self, which: NDArray[np.int64], seed: int | Sequence[int | None]) -> None:
        seeds = list(seed) if isinstance(seed, Sequence | np.ndarray) else [seed + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise InputError(f"seed: {len(seeds)} are given; expected a number, or one for each of {self.num_envs} instances")
        for one in seeds:
            if one is not None and not (isinstance(one, int | np.integer) and one >= 0):
                raise InputError(f"seed: {one} is given; expected a whole number, zero or more")
        for i in which:
            own = seeds[i]
            if own is not None:
                self._generators[i] = seeding.np_random(int(own))[0]

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        for name in options or {}:
            if name != "reset_mask":
                raise InputError(f'options: "{name}" is not known; expected "reset_mask" alone')
        everything = np.ones(self.num_envs, np.bool_)
        mask = (options or {}).get("reset_mask", everything)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            found = f"an array of {mask.dtype}, shape {list(mask.shape)}" if isinstance(mask, np.ndarray) else repr(mask)
            raise InputError(f"reset_mask: {found} is given; expected bool of shape [{self.num_envs}], true for one instance or more")
        return mask

    def _observations(self) -> NDArray[Any]:
        columns = self.batch.observations[:, self._columns]
        return columns.copy() if self.copy else columns

    def _judge(self, name: str, rule: Rule, actions: NDArray[Any], dtype: type[np.generic]) -> NDArray[Any]:
        """What the rule says of all instances, as an array of its own."""
        try:
            found = np.asarray(rule(self._seen, actions))
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{name}: {error}") from error
        if found.shape != (self.num_envs,) or not np.can_cast(found.dtype, dtype, "same_kind"):
            what = "number" if dtype == np.float64 else "truth (bool)"
            raise InputError(
                f"{name}: the function gave an array of {found.dtype}, shape {list(found.shape)}; "
                f"expected one {what} for each instance, shape [{self.num_envs}]"
            )
        return found.astype(dtype)

    def _reasons(self, failed: NDArray[np.bool_]) -> dict[str, Any]:
        if not failed.any():
            return {}
        reasons = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(failed):
            reasons[i] = self.batch.describe(int(i))
        return {"failure": reasons, "_failure": failed}

    def _final(self, ended: NDArray[np.bool_], infos: dict[str, Any]) -> dict[str, Any]:
        """What is told of episodes that ended, before others begin in their place."""
        last = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(ended):
            last[i] = self.batch.observations[i, self._columns].copy()
        return {"final_obs": last, "_final_obs": ended, "final_info": infos, "_final_info": ended.copy()}


class Env(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """One instance as an environment of Gymnasium, for those that take no vector environments: a VectorEnv of one, `self.vector`, with the
    same options but for num_envs and autoreset_mode. Its rules see arrays too, of one row. Many are stepped faster by a VectorEnv.

    SyncVectorEnv over N of them gives what a VectorEnv of N instances does, to the bit where both compute with the same instructions.
    """

    def __init__(self, source: Batch | Scene | str | os.PathLike[str], **options: Any) -> None:
        self.vector = VectorEnv(source, None if isinstance(source, Batch) else 1, autoreset_mode=AutoresetMode.DISABLED, **options)
        if self.vector.num_envs != 1:
            raise InputError(f"source: a batch of {self.vector.num_envs} instances is given; expected one of 1")
        self.metadata = {"render_modes": []}
        self.observation_space = self.vector.single_observation_space
        self.action_space = self.vector.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """A new episode. Returns its observation [width] and info with its seed."""
        observations, infos = self.vector.reset(seed=seed, options=options)
        self._np_random = self.vector._generators[0]
        if seed is not None:
            self._np_random_seed = seed
        return observations[0], self._alone(infos)

    def step(self, action: NDArray[Any]) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """VectorEnv.step of one action [actions]."""
        observations, rewards, terminated, truncated, infos = self.vector.step(np.asarray(action)[np.newaxis])
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), self._alone(infos)

    @staticmethod
    def _alone(infos: dict[str, Any]) -> dict[str, Any]:
        return {name: rows[0] for name, rows in infos.items() if not name.startswith("_")}


class _Drives:
    """What actions [N, actions] set of a batch."""

    def __init__(self, batch: Batch, names: str | Sequence[str], ranges: dict[str, tuple[float, float]], scaled: bool) -> None:
        if names == "targets":
            names = [f"target:{joint}" for joint in batch.scene.servos]
        elif isinstance(names, str):
            names = [names]
        self.names = list(names)
        if not self.names:
            raise InputError("actions: there are none; expected a scene with servos, or names such as force:JOINT")
        for name in ranges:
            if name not in self.names:
                raise InputError(f'ranges: "{name}" is no action; expected one of {", ".join(self.names)}')
        limits = np.array([self._range(batch, name, ranges, scaled) for name in self.names])
        self._middle = limits.mean(1) if scaled else np.zeros(len(limits))
        self._half = np.diff(limits)[:, 0] / 2 if scaled else np.ones(len(limits))
        self.low = np.full(len(limits), -1.0, np.float32) if scaled else limits[:, 0].astype(np.float32)
        self.high = -self.low if scaled else limits[:, 1].astype(np.float32)
        self._shape = (len(batch), len(limits))
        # by what they set: rows of the batch, columns of these, columns of the action, what these were at first
        self._parts: list[tuple[NDArray[Any], NDArray[np.int64], list[int], NDArray[Any]]] = []
        for kind, rows in (("target", "targets"), ("force", "forces")):
            mine = [k for k, name in enumerate(self.names) if name.startswith(kind + ":")]
            if mine:
                into: NDArray[Any] = getattr(batch, rows)
                columns = np.array([batch._core.column(rows, self.names[k].partition(":")[2]) for k in mine])
                self._parts.append((into, columns, mine, into[:, columns].copy()))

    @staticmethod
    def _range(batch: Batch, name: str, ranges: dict[str, tuple[float, float]], scaled: bool) -> tuple[float, float]:
        kind, _, joint = name.partition(":")
        if kind not in ("target", "force") or not joint:
            raise InputError(f'actions: "{name}" is not known; expected "targets", target:JOINT or force:JOINT')
        row = batch._core.column("forces", joint)
        model = batch.model
        low, high = (model.lower[row], model.upper[row]) if kind == "target" else (-model.max_effort[row], model.max_effort[row])
        low, high = ranges.get(name, (low, high))
        if not low < high or (scaled and not np.isfinite(high - low)):
            where = "given" if name in ranges else "in the robot's file"
            raise InputError(
                f'actions: the range of "{name}" {where} is {low:g} to {high:g}; expected one to which actions can be scaled: '
                f'ranges={{"{name}": (lowest, highest)}}'
            )
        return float(low), float(high)

    def write(self, actions: NDArray[Any]) -> NDArray[Any]:
        """Sets them all; returns the actions within their space."""
        given = np.asarray(actions)
        if given.shape != self._shape or not np.can_cast(given.dtype, np.float64, "same_kind"):
            found = f"an array of {given.dtype}, shape {list(given.shape)}"
            raise InputError(f"actions: {found} is given; expected numbers of shape {list(self._shape)}")
        if not np.isfinite(given).all():
            instance, k = (int(where) for where in np.argwhere(~np.isfinite(given))[0])
            raise InputError(f'actions: "{self.names[k]}" of instance {instance} is {given[instance, k]}; expected a finite number')
        within: NDArray[Any] = np.clip(given, self.low, self.high)
        values = self._middle + self._half * within.astype(np.float64)
        for rows, columns, mine, _ in self._parts:
            rows[:, columns] = values[:, mine]
        return within

    def release(self, which: NDArray[np.int64]) -> None:
        """As it was at first."""
        for rows, columns, _, at_first in self._parts:
            rows[np.ix_(which, columns)] = at_first[which]


def _mode(given: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        known = ", ".join(f'"{mode.value}"' for mode in AutoresetMode)
        raise InputError(f"autoreset_mode: {given!r} is not known; expected one of {known}") from None


def _count(name: str, value: int | None) -> int:
    if value is None or value < 1 or int(value) != value:
        raise InputError(f"{name}: {value} is given; expected a whole number, one or more")
    return int(value)
