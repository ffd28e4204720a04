"""linden.gym gives right values: beside plain loops over single simulations, over seeds and at the ends of episodes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import linden

gymnasium = pytest.importorskip("gymnasium")

import linden.gym  # noqa: E402
from gymnasium.utils import seeding  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402
from gym_cart import MODES, USUAL, actions_of, cart, vector  # noqa: E402


class Plain:
    """One instance of `vector`, written to be read: a Simulation that is stepped, looked at and started anew."""

    def __init__(self, seed: int) -> None:
        self.generator = seeding.np_random(seed)[0]
        self.reset()

    def reset(self) -> np.ndarray:
        self.seed = int(self.generator.integers(2**63))
        start = linden.Batch(cart(), 1)
        start.reset(seed=self.seed, spread=USUAL["spread"])
        self.simulation = linden.Simulation(cart())
        self.simulation.q, self.simulation.v = start.q[0], start.v[0]
        self.steps = 0
        return self.observation()

    def observation(self) -> np.ndarray:
        return np.concatenate([self.simulation.q, self.simulation.v])

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool]:
        # the file limits the slide to -3 .. 1; the swing's range is given as -2 .. 2
        self.simulation.joint("slide").target = -1 + 2 * float(action[0])
        self.simulation.joint("swing").force = 2 * float(action[1])
        self.simulation.run(4)
        self.steps += 1
        angle = float(self.simulation.q[1])
        return self.observation(), np.cos(angle) - 0.1 * abs(action[0]), abs(angle) > 0.4, self.steps >= 12


# -- right values


@pytest.mark.parametrize("mode", MODES)
def test_it_does_what_a_plain_loop_over_simulations_does(mode: AutoresetMode) -> None:
    """Positions to the tolerance of the solver, as a batch computes with other instructions than a Simulation. Velocities to single
    precision: so a batch remembers the last displacement, which bounds the velocity that is read (engine/VELOCITY.md)."""
    env = vector(autoreset_mode=mode, observation_dtype=np.float64)
    plain = [Plain(seed=11 + i) for i in range(5)]
    observations, infos = env.reset(seed=11)

    def assert_near(found: np.ndarray, expected: np.ndarray) -> None:
        np.testing.assert_allclose(found[:2], expected[:2], rtol=0, atol=1e-9)
        np.testing.assert_allclose(found[2:], expected[2:], rtol=3 * 2**-23, atol=1e-7)

    for i, one in enumerate(plain):
        assert_near(observations[i], one.observation())
    assert [one.seed for one in plain] == list(infos["seed"])

    waiting = [False] * 5  # in next-step mode: to begin anew
    ends = set()
    for actions in actions_of(env, 40):
        observations, rewards, terminated, truncated, infos = env.step(actions)
        to_reset = np.zeros(5, np.bool_)
        for i, one in enumerate(plain):
            expected: np.ndarray | None = None
            reward, ended, cut = 0.0, False, False
            if waiting[i]:
                expected = one.reset()
            else:
                expected, reward, ended, cut = one.step(actions[i])
            np.testing.assert_allclose(rewards[i], reward, rtol=0, atol=1e-8)
            assert (terminated[i], truncated[i]) == (ended, cut)
            waiting[i] = (ended or cut) and mode == AutoresetMode.NEXT_STEP
            if ended or cut:
                ends.add((ended, cut))
                to_reset[i] = True
                if mode == AutoresetMode.SAME_STEP:
                    assert infos["_final_obs"][i] and infos["_final_info"][i]
                    assert_near(infos["final_obs"][i], expected)
                    expected = one.reset()
                    assert infos["seed"][i] == one.seed
            elif mode == AutoresetMode.SAME_STEP and "final_obs" in infos:
                assert not infos["_final_obs"][i] and infos["final_obs"][i] is None
            assert_near(observations[i], expected)
        if mode == AutoresetMode.DISABLED and to_reset.any():
            observations, _ = env.reset(options={"reset_mask": to_reset})
            for i in np.flatnonzero(to_reset):
                assert_near(observations[i], plain[i].reset())
    assert {(True, False), (False, True)} <= ends


def test_targets_and_forces_that_are_actions_begin_as_the_scene_has_them() -> None:
    env = vector(2, observe=["q", "targets"], max_episode_steps=3)
    first, _ = env.reset(seed=1)
    assert np.array_equal(first[:, 2], np.zeros(2))  # where the slide starts
    after, *_ = env.step(np.full((2, 2), 1, np.float32))
    assert np.array_equal(after[:, 2], np.ones(2)) and np.array_equal(env.batch.forces[:, 1], [2, 2])
    env.batch.forces[:, 0] = 5
    again, _ = env.reset(seed=1)
    assert np.array_equal(first, again)
    assert np.array_equal(env.batch.forces, [[5, 0], [5, 0]])  # what is no action stays


def test_actions_are_scaled_to_the_limits_of_the_file_or_given_in_units() -> None:
    scaled = vector(1, actions=["force:slide", "target:slide"], ranges={})
    assert np.array_equal(scaled.single_action_space.low, [-1, -1]) and np.array_equal(scaled.single_action_space.high, [1, 1])
    scaled.reset(seed=1)
    scaled.step(np.array([[0.5, -1.0]], np.float32))
    assert scaled.batch.forces[0, 0] == 10 and scaled.batch.targets[0, 0] == -3
    scaled.step(np.array([[-7.0, 7.0]], np.float32))  # beyond the space is its border
    assert scaled.batch.forces[0, 0] == -20 and scaled.batch.targets[0, 0] == 1

    units = vector(1, actions=["force:slide", "target:slide"], ranges={"target:slide": (-0.5, 0.25)}, scaled=False)
    assert np.array_equal(units.single_action_space.low, [-20, -0.5]) and np.array_equal(units.single_action_space.high, [20, 0.25])
    units.reset(seed=1)
    units.step(np.array([[7.5, 0.125]], np.float32))
    assert units.batch.forces[0, 0] == 7.5 and units.batch.targets[0, 0] == 0.125
    assert vector(1, actions="targets", ranges={}).single_action_space.shape == (1,)


def test_functions_are_given_live_columns_and_the_actions_within_their_space() -> None:
    given: list[Any] = []

    def look(seen: linden.gym.Seen, actions: np.ndarray) -> np.ndarray:
        given.append((seen, actions.copy()))
        return np.arange(3)

    env = vector(3, reward=look, terminated=None, watch=["q:swing", "energy"])
    env.reset(seed=1)
    _, rewards, terminated, *_ = env.step(np.full((3, 2), 9, np.float32))
    seen, actions = given[0]
    assert list(seen) == ["q", "v", "q:swing", "energy"] and not terminated.any()
    assert np.array_equal(rewards, [0, 1, 2]) and np.array_equal(actions, np.ones((3, 2)))
    assert all(np.shares_memory(columns, env.batch.observations) for columns in seen.values())
    assert np.array_equal(seen["q"][:, 1:], seen["q:swing"])


def test_observations_come_in_the_order_they_were_named_from_a_batch_of_ones_own() -> None:
    batch = linden.Batch(cart(), 3, observe=["time", "v", "q"])
    env = linden.gym.VectorEnv(batch, reward=lambda seen, actions: seen["time"][:, 0], observe=["q", "time"], spread=0.1)
    assert env.batch is batch and env.single_observation_space.dtype == np.float64
    observations, _ = env.reset(seed=4)
    assert np.array_equal(observations, batch.observations[:, [3, 4, 0]])
    everything = linden.gym.VectorEnv(batch, reward=lambda seen, actions: seen["time"][:, 0])
    assert everything.single_observation_space.shape == (5,)


# -- seeds


def test_episodes_depend_on_their_seeds_alone() -> None:
    def run(env: linden.gym.VectorEnv, seed: Any, actions: np.ndarray) -> list[np.ndarray]:
        return [env.reset(seed=seed)[0], *(env.step(row)[0] for row in actions)]

    long = actions_of(vector(6), 30)
    alone = run(vector(6, threads=1), 21, long)
    for other in (run(vector(6, threads=3), 21, long), run(vector(6), [21 + i for i in range(6)], long)):
        assert all(np.array_equal(one, two) for one, two in zip(alone, other))
    # instance 2 of six is instance 0 of two whose seeds begin two later
    company = run(vector(2), 23, long[:, 2:4])
    assert all(np.array_equal(one[2:4], two) for one, two in zip(alone, company))
    assert not np.array_equal(alone[0], run(vector(6), 22, long)[0])
    assert len({row.tobytes() for row in alone[0]}) == 6

    # what came before does not matter, and an episode after the first is another
    env = vector(6)
    run(env, 5, long[:17])
    assert all(np.array_equal(one, two) for one, two in zip(alone, run(env, 21, long)))
    assert not np.array_equal(env.reset(seed=21)[0], env.reset()[0])


def test_without_a_seed_every_environment_is_another() -> None:
    assert not np.array_equal(vector().reset()[0], vector().reset()[0])


def test_what_a_scene_randomises_is_drawn_for_every_episode() -> None:
    scene = cart(randomize={"masses": 0.5, "gains": 0.2})
    env = vector(3, scene=scene)
    env.batch.gains[:] = 1  # rows that were touched show what is drawn all the same
    drawn = []
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        drawn.append((env.batch.get("mass:pole").copy(), env.batch.gains.copy()))
    for first, second, again in zip(*drawn):
        assert np.array_equal(first, again) and not np.isclose(first, second).any()
        assert len(np.unique(first)) == 3


def test_an_episode_can_be_had_again_from_the_seed_in_its_info() -> None:
    env = vector(4)
    observations, infos = env.reset(seed=9)
    batch = linden.Batch(cart(), 2, observe=["q", "v"], observation_dtype=np.float32)
    batch.reset([1], seed=[int(infos["seed"][3])], spread=0.3)
    assert np.array_equal(batch.observations[1], observations[3])


def test_a_mask_resets_its_instances_alone() -> None:
    env = vector(autoreset_mode="Disabled", max_episode_steps=None, terminated=None)
    untouched = vector(max_episode_steps=None, terminated=None)
    mask = np.array([True, False, False, True, False])
    actions = actions_of(env, 8)
    for one in (env, untouched):
        one.reset(seed=2)
        for row in actions[:4]:
            one.step(row)
    before = untouched.batch.observations.copy()
    observations, infos = env.reset(seed=[50, None, None, None, None], options={"reset_mask": mask})
    assert np.array_equal(observations[~mask], before[~mask, :4]) and not np.isclose(observations[mask], before[mask, :4]).any()
    assert np.array_equal(infos["_seed"], mask) and np.array_equal(infos["seed"][~mask], [0, 0, 0])
    assert infos["seed"][0] == seeding.np_random(50)[0].integers(2**63)
    # the others go on as if nothing had been
    for row in actions[4:]:
        assert np.array_equal(env.step(row)[0][~mask], untouched.step(row)[0][~mask])


# -- ends


def test_time_limits_truncate() -> None:
    env = vector(terminated=None, max_episode_steps=3)
    env.reset(seed=1)
    ends = [env.step(row)[2:4] for row in actions_of(env, 9)]
    # three steps of an episode, then one in which the next begins
    assert [bool(truncated.all()) for _, truncated in ends] == [False, False, True, False, False, False, True, False, False]
    assert not any(terminated.any() for terminated, _ in ends)
    assert all(truncated.all() or not truncated.any() for _, truncated in ends)


@pytest.mark.parametrize("mode", MODES)
def test_a_failure_truncates_with_its_reason_and_leaves_the_others_alone(mode: AutoresetMode) -> None:
    """A force of 1e14 N m would turn the pole by half a turn and more within a step, however it is split; such steps are refused."""
    options: dict[str, Any] = dict(ranges={"force:swing": (-1e14, 1e14)}, terminated=None, max_episode_steps=None, autoreset_mode=mode)
    env, calm = vector(**options), vector(**options)
    env.reset(seed=1), calm.reset(seed=1)
    still = np.zeros((5, 2), np.float32)
    push = still.copy()
    push[3, 1] = 1
    before = env.batch.observations[:, :4].copy()
    (observations, _, terminated, truncated, infos), expected = env.step(push), calm.step(still)[0]
    others = np.arange(5) != 3
    assert not terminated.any() and np.array_equal(truncated, ~others)
    assert np.array_equal(observations[others], expected[others])
    assert np.isfinite(observations).all()

    told = infos
    if mode == AutoresetMode.SAME_STEP:
        assert np.array_equal(infos["final_obs"][3], before[3])  # the last good state: that before the first step
        assert not np.array_equal(observations[3], before[3])
        told = infos["final_info"]
    else:
        assert np.array_equal(observations[3], before[3])
    assert np.array_equal(told["_failure"], ~others)
    assert "step" in told["failure"][3] and [told["failure"][i] for i in np.flatnonzero(others)] == [None] * 4

    if mode == AutoresetMode.DISABLED:
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"1 of 5 instances, such as 3, are over"):
            env.step(still)
        env.reset(options={"reset_mask": truncated})
    # its next episode runs, and is not told as failed again
    for _ in range(3):
        _, _, _, truncated, infos = env.step(still)
        assert not truncated.any() and "failure" not in infos
    assert not env.batch.failed.any()


def test_a_step_before_the_first_reset_is_refused() -> None:
    for mode in MODES:
        with pytest.raises(gymnasium.error.ResetNeeded, match="5 of 5 instances"):
            vector(autoreset_mode=mode).step(np.zeros((5, 2), np.float32))
        env = vector(autoreset_mode=mode)
        env.reset(options={"reset_mask": np.array([True, True, True, True, False])})
        with pytest.raises(gymnasium.error.ResetNeeded, match="1 of 5 instances, such as 4"):
            env.step(np.zeros((5, 2), np.float32))
