"""linden.gym is what Gymnasium asks of an environment, and hands out arrays that stay."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import linden

gymnasium = pytest.importorskip("gymnasium")

import linden.gym  # noqa: E402
from gymnasium.utils.env_checker import check_env, data_equivalence  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402
from gym_cart import MODES, USUAL, actions_of, cart, vector  # noqa: E402


# -- what Gymnasium asks


@pytest.mark.filterwarnings("ignore:.*Box (observation|action) space:UserWarning")
def test_gymnasiums_checker_finds_nothing_wrong_with_an_env() -> None:
    check_env(linden.gym.Env(cart(), **USUAL), skip_render_check=True)
    check_env(linden.gym.Env(cart(), **{**USUAL, "scaled": False}), skip_render_check=True)


@pytest.mark.parametrize("mode", MODES)
def test_a_vector_env_gives_what_its_spaces_say(mode: AutoresetMode) -> None:
    env = vector(autoreset_mode=mode)
    assert isinstance(env, gymnasium.vector.VectorEnv)
    assert env.metadata["autoreset_mode"] == mode
    assert env.observation_space == gymnasium.vector.utils.batch_space(env.single_observation_space, 5)
    assert env.action_space == gymnasium.vector.utils.batch_space(env.single_action_space, 5)
    assert env.single_observation_space == gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float32)
    observations, infos = env.reset(seed=1)
    assert observations in env.observation_space and isinstance(infos, dict)
    for _ in range(5):
        observations, rewards, terminated, truncated, infos = env.step(env.action_space.sample())
        assert observations in env.observation_space and isinstance(infos, dict)
        for numbers, dtype in ((rewards, np.float64), (terminated, np.bool_), (truncated, np.bool_)):
            assert numbers.shape == (5,) and numbers.dtype == dtype
        if mode == AutoresetMode.DISABLED and (terminated | truncated).any():
            env.reset(options={"reset_mask": terminated | truncated})
    env.close()
    assert env.closed


@pytest.mark.parametrize("mode", MODES)
def test_it_gives_what_gymnasiums_own_vector_env_makes_of_single_ones(mode: AutoresetMode) -> None:
    """SyncVectorEnv over N Envs: observations, rewards, ends and infos with their masks, to the bit."""
    ours = vector(autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: linden.gym.Env(cart(), **USUAL)] * 5, autoreset_mode=mode)
    pairs = [(ours.reset(seed=3), theirs.reset(seed=3))]
    ends = 0
    for actions in actions_of(ours, 40):
        pairs.append((ours.step(actions), theirs.step(actions)))
        over = pairs[-1][0][2] | pairs[-1][0][3]
        ends += int(over.sum())
        if mode == AutoresetMode.DISABLED and over.any():
            pairs.append((ours.reset(options={"reset_mask": over}), theirs.reset(options={"reset_mask": over.copy()})))
    for mine, other in pairs:
        assert data_equivalence(mine, other, exact=True), f"{mine}\n{other}"
    assert ends > 10


@pytest.mark.parametrize("wrapper", ["RecordEpisodeStatistics", "NormalizeObservation", "NormalizeReward", "DictInfoToList"])
def test_gymnasiums_wrappers_take_it(wrapper: str) -> None:
    env = getattr(gymnasium.wrappers.vector, wrapper)(vector())
    env.reset(seed=1)
    told: list[Any] = []
    for actions in actions_of(env, 15):
        observations, rewards, *_, infos = env.step(actions)
        assert observations.shape == (5, 4) and np.isfinite(observations).all() and np.isfinite(rewards).all()
        told.append(infos)
    if wrapper == "RecordEpisodeStatistics":
        lengths = np.concatenate([infos["episode"]["l"][infos["_episode"]] for infos in told if "episode" in infos])
        assert len(lengths) >= 5 and lengths.max() <= 12 and lengths.min() >= 1


def test_it_can_be_registered_and_made_by_name() -> None:
    gymnasium.register(
        "LindenCart-v0",
        entry_point=lambda **options: linden.gym.Env(cart(), **{**USUAL, **options}),
        vector_entry_point=lambda num_envs, **options: vector(num_envs, **options),
    )
    try:
        one = gymnasium.make("LindenCart-v0")
        assert one.reset(seed=1)[0].shape == (4,)
        many = gymnasium.make_vec("LindenCart-v0", num_envs=3, vectorization_mode="vector_entry_point")
        assert many.reset(seed=1)[0].shape == (3, 4)
        assert np.array_equal(one.reset(seed=1)[0], many.reset(seed=1)[0][0])
    finally:
        del gymnasium.registry["LindenCart-v0"]


# -- arrays


@pytest.mark.parametrize("mode", MODES)
def test_copies_stay_as_they_are(mode: AutoresetMode) -> None:
    env = vector(autoreset_mode=mode, max_episode_steps=3, terminated=None)
    kept: list[np.ndarray] = []

    def keep(*given: Any) -> None:
        for numbers in given:
            if isinstance(numbers, np.ndarray):
                kept.append(numbers)
            elif isinstance(numbers, dict):
                keep(*numbers.values())

    keep(*env.reset(seed=1))
    for k, row in enumerate(actions_of(env, 6)):
        keep(*env.step(row))
        if k == 2 and mode == AutoresetMode.DISABLED:
            keep(*env.reset())
    as_given = [numbers.copy() for numbers in kept]
    if mode == AutoresetMode.DISABLED:
        env.reset()
    for row in actions_of(env, 3, seed=8):
        env.step(row)
    assert all(data_equivalence(now, then, exact=True) for now, then in zip(kept, as_given))
    for one, other in itertools.combinations(kept, 2):
        assert one.dtype == object or not np.shares_memory(one, other)
    assert not any(np.shares_memory(numbers, env.batch.observations) for numbers in kept if numbers.dtype != object)


def test_views_are_the_batchs_own_memory() -> None:
    env = vector(copy=False)
    first, _ = env.reset(seed=1)
    second, *_ = env.step(np.zeros((5, 2), np.float32))
    assert np.shares_memory(first, env.batch.observations) and np.array_equal(first, second)


def test_what_a_function_returns_stays_its_own() -> None:
    mine, ends = np.arange(5, dtype=np.float32), np.array([True, False, False, False, True])
    env = vector(reward=lambda seen, actions: mine, terminated=lambda seen, actions: ends)
    env.reset(seed=1)
    for zeroed in ([], [0, 4]):
        _, rewards, terminated, *_ = env.step(np.zeros((5, 2), np.float32))
        assert rewards.dtype == np.float64 and np.array_equal(rewards, [0 if i in zeroed else i for i in range(5)])
        assert not np.shares_memory(rewards, mine) and not np.shares_memory(terminated, ends)
    assert np.array_equal(mine, np.arange(5)) and ends.sum() == 2
