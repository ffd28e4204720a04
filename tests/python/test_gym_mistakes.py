"""Mistakes with linden.gym are named."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import linden

pytest.importorskip("gymnasium")

import linden.gym  # noqa: E402
from gym_cart import cart, upright, vector  # noqa: E402


@pytest.mark.parametrize(
    "rule, words",
    [
        (lambda seen, actions: seen["q:swing"], ["reward", "float32", "[5, 1]", "one number for each instance", "[5]"]),
        (lambda seen, actions: 1.0, ["reward", "[]", "[5]"]),
        (lambda seen, actions: np.zeros(4), ["reward", "[4]", "[5]"]),
        (lambda seen, actions: np.array(["a"] * 5), ["reward", "<U1", "number"]),
        (lambda seen, actions: None, ["reward", "object", "number"]),
        (lambda seen, actions: np.zeros(5, complex), ["reward", "complex128", "number"]),
        (lambda seen, actions: [[1, 2], [3]], ["reward", "inhomogeneous"]),
        (lambda seen, actions: seen["q:swin"][:, 0], ['"q:swin" is not observed', 'did you mean "q:swing"?']),
    ],
)
def test_a_reward_of_the_wrong_kind_is_one_clear_error(rule: Callable[..., Any], words: list[str]) -> None:
    env = vector(reward=rule)
    env.reset(seed=1)
    with pytest.raises(linden.InputError) as raised:
        env.step(np.zeros((5, 2), np.float32))
    assert all(word in str(raised.value) for word in words), str(raised.value)


@pytest.mark.parametrize("value", [np.zeros(5), np.zeros((5, 1), np.bool_), True])
def test_a_termination_of_the_wrong_kind_is_one_clear_error(value: Any) -> None:
    env = vector(terminated=lambda seen, actions: value)
    env.reset(seed=1)
    with pytest.raises(linden.InputError, match=r"terminated: .*truth \(bool\) for each instance, shape \[5\]"):
        env.step(np.zeros((5, 2), np.float32))


@pytest.mark.parametrize(
    "options, words",
    [
        ({"observe": ["q", "pose:pol"]}, ["pose:pol"]),
        ({"observe": [], "watch": []}, ["observe"]),
        ({"actions": []}, ["actions", "none"]),
        ({"actions": ["torque:slide"], "ranges": {}}, ["torque:slide", "force:JOINT"]),
        ({"actions": ["force:slid"], "ranges": {}}, ["slid", "slide"]),
        ({"actions": ["target:swing"], "ranges": {"target:swing": (-1, 1)}}, ["swing", "servo"]),
        ({"actions": ["force:swing"], "ranges": {}}, ["force:swing", "inf", "ranges="]),
        ({"ranges": {"force:swing": (2, -2)}}, ["force:swing", "given", "2 to -2"]),
        ({"ranges": {"force:slide": (-2, 2)}}, ["ranges", "force:slide", "target:slide"]),
        ({"frame_skip": 0}, ["frame_skip", "0"]),
        ({"max_episode_steps": -1}, ["max_episode_steps", "-1"]),
        ({"spread": -0.5}, ["spread", "-0.5"]),
        ({"autoreset_mode": "Never"}, ["autoreset_mode", "Never", "NextStep"]),
        ({"observe": None}, ["observe", "nothing is named"]),
    ],
)
def test_options_that_make_no_sense_are_named(options: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(linden.InputError) as raised:
        vector(**options).reset(seed=1)
    assert all(word in str(raised.value) for word in words), str(raised.value)


def test_batches_and_counts_that_do_not_agree_are_named() -> None:
    batch = linden.Batch(cart(), 3, observe=["q"])
    with pytest.raises(linden.InputError, match="num_envs: 4 .* 3 instances"):
        linden.gym.VectorEnv(batch, 4, reward=upright)
    with pytest.raises(linden.InputError, match='"v" is not observed'):
        linden.gym.VectorEnv(batch, reward=upright, observe=["v"])
    with pytest.raises(linden.InputError, match="num_envs: None"):
        linden.gym.VectorEnv(cart(), reward=upright, observe=["q"])
    with pytest.raises(linden.InputError, match="batch of 3"):
        linden.gym.Env(batch, reward=upright)


@pytest.mark.parametrize(
    "actions, words",
    [
        (np.zeros((5, 3)), ["actions", "[5, 3]", "[5, 2]"]),
        (np.zeros(2), ["actions", "[2]", "[5, 2]"]),
        (np.full((5, 2), "a"), ["actions", "<U1"]),
        (np.array([[0, 0], [0, 0], [0, np.nan], [0, 0], [0, 0]]), ["force:swing", "instance 2", "nan", "finite"]),
    ],
)
def test_actions_that_make_no_sense_are_named_and_step_nothing(actions: np.ndarray, words: list[str]) -> None:
    env = vector()
    env.reset(seed=1)
    before = env.batch.observations.copy()
    with pytest.raises(linden.InputError) as raised:
        env.step(actions)
    assert all(word in str(raised.value) for word in words), str(raised.value)
    assert np.array_equal(env.batch.steps, np.zeros(5)) and np.array_equal(env.batch.observations, before)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"options": {"reset_mas": 1}}, ["reset_mas", "reset_mask"]),
        ({"options": {"reset_mask": [True] * 5}}, ["reset_mask", "True", "[5]"]),
        ({"options": {"reset_mask": np.ones(4, np.bool_)}}, ["reset_mask", "[4]", "[5]"]),
        ({"options": {"reset_mask": np.ones(5)}}, ["reset_mask", "float64", "bool"]),
        ({"options": {"reset_mask": np.zeros(5, np.bool_)}}, ["reset_mask", "one instance or more"]),
        ({"seed": [1, 2]}, ["seed", "2", "5"]),
        ({"seed": -3}, ["seed", "-3", "zero or more"]),
        ({"seed": 0.5}, ["seed", "0.5", "whole number"]),
        ({"seed": [1, 2, "three", None, 5]}, ["seed", "three", "whole number"]),
    ],
)
def test_resets_that_make_no_sense_are_named(given: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(linden.InputError) as raised:
        vector().reset(**given)
    assert all(word in str(raised.value) for word in words), str(raised.value)


def test_where_gymnasium_is_missing_linden_works_and_its_gym_says_what_to_install() -> None:
    program = "import sys; sys.modules['gymnasium'] = None; import linden; print('linden is there'); import linden.gym"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ran.returncode == 1 and "linden is there" in ran.stdout
    assert "ImportError: linden.gym needs Gymnasium 1.1 or newer" in ran.stderr and "pip install gymnasium" in ran.stderr
