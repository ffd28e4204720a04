"""States of models, and motion from them in small steps, for differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import linden

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def joint_rows(model: linden.Model) -> list[tuple[str, slice, slice]]:
    """Of every joint: name, rows of q, rows of v."""
    sim = linden.Simulation(model)
    return [(name, sim.joint(name).q_rows, sim.joint(name).v_rows) for name in model.joints]


def random_state(model: linden.Model, seed: int, gravity: Array | None = None) -> linden.Kinematics:
    """Any turn, places and speeds of about one; followers follow."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, model.nq)
    v, a = rng.uniform(-1, 1, (2, model.nv))
    pull = rng.uniform(-10, 10, 3) if gravity is None else gravity
    return linden.Kinematics(model, q, v, a, gravity=pull)


def times(a: Array, b: Array) -> Array:
    """Product of quaternions x y z w."""
    return np.array([*(a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])), a[3] * b[3] - a[:3] @ b[:3]])


def rotation_of(x: Array) -> Array:
    """Matrix of a unit quaternion x y z w."""
    u, w = x[:3], x[3]
    cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def moved(model: linden.Model, q: Array, v: Array, h: float) -> Array:
    """A smooth path from q that sets out with velocities v, a time h away."""
    after = q.copy()
    for _, q_rows, v_rows in joint_rows(model):
        rate = v[v_rows]
        if len(rate) == 1:
            after[q_rows] += h * rate
            continue
        turn = slice(q_rows.stop - 4, q_rows.stop)
        half = 0.5 * h * rate[:3]
        angle = np.linalg.norm(half)
        small = np.array([*(half * np.sinc(angle / np.pi)), np.cos(angle)])
        if len(rate) == 6:
            after[q_rows.start : q_rows.start + 3] += h * rotation_of(q[turn]) @ rate[3:]
        after[turn] = times(q[turn], small)
    return after


def state_at(state: linden.Kinematics, t: float) -> linden.Kinematics:
    """A time t away on a path that sets out as the state does: rates of what depends on q and v are those of the motion at t = 0,
    later ones are not."""
    q = moved(state.model, state.q, state.v, t)
    return linden.Kinematics(state.model, q, state.v + t * state.a, state.a, gravity=state.gravity)


def difference(ask: Callable[[linden.Kinematics], Array | float], state: linden.Kinematics, h: float = 1e-4) -> Array:
    """Derivative by time of what is asked, by differences to fourth order of h: 1e-9 or better of smooth numbers of about one."""
    one = np.asarray(ask(state_at(state, h))) - np.asarray(ask(state_at(state, -h)))
    two = np.asarray(ask(state_at(state, 2 * h))) - np.asarray(ask(state_at(state, -2 * h)))
    return (8 * one - two) / (12 * h)
