"""A cart whose servo moves it and a pole on it: the environment of the tests of linden.gym."""

from __future__ import annotations

from typing import Any

import numpy as np

import linden
import linden.gym
from linden.gym import AutoresetMode

MODES = list(AutoresetMode)

CART = """
<robot name="cart">
  <link name="rail"/>
  <link name="cart"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="pole"><inertial><origin xyz="0 0 0.5"/><mass value="0.2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-3" upper="1" effort="20" velocity="10"/></joint>
  <joint name="swing" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 1 0"/></joint>
</robot>
"""


def cart(**settings: Any) -> linden.Scene:
    effects = {"gravity": [0, 0, -9.81], "servo": {"stiffness": 100, "damping": 10, "joints": ["slide"]}}
    return linden.scene(linden.parse_urdf(CART), **{"step": 5e-3, "effects": effects, **settings})


def upright(seen: linden.gym.Seen, actions: np.ndarray) -> np.ndarray:
    return np.cos(seen["q:swing"][:, 0].astype(float)) - 0.1 * np.abs(actions[:, 0])


def tilted(seen: linden.gym.Seen, actions: np.ndarray) -> np.ndarray:
    return np.abs(seen["q:swing"][:, 0]) > 0.4


USUAL: dict[str, Any] = dict(
    observe=["q", "v"], watch=["q:swing"], actions=["target:slide", "force:swing"], ranges={"force:swing": (-2, 2)}, frame_skip=4,
    max_episode_steps=12, spread=0.3, reward=upright, terminated=tilted,
)


def vector(num_envs: int = 5, scene: linden.Scene | None = None, **options: Any) -> linden.gym.VectorEnv:
    return linden.gym.VectorEnv(scene or cart(), num_envs, **{**USUAL, **options})


def actions_of(env: Any, steps: int, seed: int = 7) -> np.ndarray:
    shape = (steps, env.num_envs, *env.single_action_space.shape)
    return np.random.default_rng(seed).uniform(-1, 1, shape).astype(np.float32)
