"""What can be asked of a state, against Pinocchio's wheel (`pin`), on real robots and random trees.

Pinocchio has linear before angular, mimic joints as if they were free, continuous joints as cosine and sine, and joint frames that are not
turned to their axes. Its velocities are P times those of linden; forces and matrices of linden are P^T times its.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import linden
from places import NINE_ROBOTS, OWN_ROBOTS, robot_file
from random_trees import random_tree
from states import Array, joint_rows, random_state

pin = pytest.importorskip("pinocchio", reason="Pinocchio's wheel `pin` is not installed")

ROUNDING = 1e-12  # of sums over some hundred bodies; found are 1e-15
FRAMES = {"aligned": pin.LOCAL_WORLD_ALIGNED, "link": pin.LOCAL, "world": pin.WORLD}
BODIES = [*OWN_ROBOTS, *NINE_ROBOTS, *(f"random:{seed}" for seed in range(1, 11))]
SUBJECTS = [pytest.param((name, base), id=f"{name}-{base}") for name in BODIES for base in ("fixed", "floating")]


class Twin:
    """A robot and a state of it in linden and in Pinocchio."""

    def __init__(self, name: str, base: str, folder: Path) -> None:
        if name.startswith("random:"):
            file = folder / f"{name[7:]}.urdf"
            file.write_text(random_tree(int(name[7:]), links=18))
        else:
            file = robot_file(name)
        self.linden = linden.load(file, base)
        self.state = random_state(self.linden, 7)
        root = [pin.JointModelFreeFlyer()] if base == "floating" else []
        self.pin = pin.buildModelFromUrdf(str(file), *root)
        self.pin.gravity.linear = self.state.gravity
        self.data = self.pin.createData()
        self.rows = {joint: (q_rows, v_rows) for joint, q_rows, v_rows in joint_rows(self.linden)}
        self._match(_mimics(file))
        self.v, self.a = self.P @ self.state.v, self.P @ self.state.a
        pin.computeAllTerms(self.pin, self.data, self.q, self.v)
        pin.forwardKinematics(self.pin, self.data, self.q, self.v, self.a)
        pin.updateFramePlacements(self.pin, self.data)

    def _match(self, mimics: dict[str, tuple[str, float]]) -> None:
        """q, and P [nv of Pinocchio, nv]."""
        self.q = pin.neutral(self.pin)
        self.P = np.zeros((self.pin.nv, self.linden.nv))
        for name, joint in zip(self.pin.names[1:], self.pin.joints[1:], strict=True):
            if joint.nv == 6:
                q_rows, v_rows = next(rows for rows in self.rows.values() if rows[1].stop - rows[1].start == 6)
                self.q[joint.idx_q : joint.idx_q + 7] = self.state.q[q_rows]
                self.P[joint.idx_v : joint.idx_v + 3, v_rows.start + 3 : v_rows.stop] = np.eye(3)
                self.P[joint.idx_v + 3 : joint.idx_v + 6, v_rows.start : v_rows.start + 3] = np.eye(3)
                continue
            value = self.state.q[self.rows[name][0].start]
            self.q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(value), np.sin(value)] if joint.nq == 2 else value
            leader, factor = name, 1.0
            while leader in mimics:
                factor *= mimics[leader][1]
                leader = mimics[leader][0]
            self.P[joint.idx_v, self.rows[leader][1].start] = factor

    def links(self) -> list[tuple[str, int]]:
        return [(frame.name, k) for k, frame in enumerate(self.pin.frames) if frame.type == pin.FrameType.BODY and frame.name != "universe"]

    def mass_matrix(self) -> Array:
        upper = np.triu(np.atleast_2d(pin.crba(self.pin, self.data, self.q)))
        return self.P.T @ (upper + np.triu(upper, 1).T) @ self.P


def _mimics(file: Path) -> dict[str, tuple[str, float]]:
    found = {}
    for joint in ElementTree.parse(file).getroot().findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            found[joint.get("name", "")] = (mimic.get("joint", ""), float(mimic.get("multiplier", 1)))
    return found


@lru_cache(maxsize=None)
def made(name: str, base: str, folder: Path) -> Twin:
    return Twin(name, base, folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("trees")


@pytest.fixture
def twin(request: pytest.FixtureRequest, folder: Path) -> Twin:
    return made(*request.param, folder)


def every_robot(test: Any) -> Any:
    return pytest.mark.parametrize("twin", SUBJECTS, indirect=True)(test)


def close(found: Array, expected: Array, tolerance: float = ROUNDING) -> None:
    """Relative to the largest number, or to one."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0) <= tolerance * max(1, np.abs(expected).max(initial=0))


def angular_first(motion: Any) -> Array:
    return np.array([*motion.angular, *motion.linear])


@every_robot
def test_links_move_alike(twin: Twin) -> None:
    state = twin.state
    assert len(twin.links()) > len(twin.linden.joints) - 1
    for link, k in twin.links():
        pose = state.pose(link)
        close(pose.matrix, twin.data.oMf[k].homogeneous)
        for frame, reference in FRAMES.items():
            close(state.twist(link, frame), angular_first(pin.getFrameVelocity(twin.pin, twin.data, k, reference)))
            J = pin.computeFrameJacobian(twin.pin, twin.data, twin.q, k, reference).reshape(6, twin.pin.nv) @ twin.P
            close(state.jacobian(link, frame), np.vstack([J[3:], J[:3]]))
            if frame != "aligned":  # which Pinocchio turns without moving it
                close(state.spatial_acceleration(link, frame), angular_first(pin.getFrameAcceleration(twin.pin, twin.data, k, reference)))
            if frame != "world":
                classical = pin.getFrameClassicalAcceleration(twin.pin, twin.data, k, reference)
                close(state.acceleration(link, frame), angular_first(classical))
        felt = pin.getFrameClassicalAcceleration(twin.pin, twin.data, k, pin.LOCAL).linear - twin.data.oMf[k].rotation.T @ state.gravity
        close(state.imu(link), [*pin.getFrameVelocity(twin.pin, twin.data, k, pin.LOCAL).angular, *felt])


@every_robot
def test_points_move_alike(twin: Twin) -> None:
    rng = np.random.default_rng(1)
    for link, k in twin.links():
        point = rng.uniform(-0.5, 0.5, 3)
        J = pin.computeFrameJacobian(twin.pin, twin.data, twin.q, k, pin.LOCAL_WORLD_ALIGNED).reshape(6, twin.pin.nv) @ twin.P
        close(twin.state.point_jacobian(link, point), J[:3] - pin.skew(twin.data.oMf[k].rotation @ point) @ J[3:])


@every_robot
def test_masses_and_forces_are_alike(twin: Twin) -> None:
    state = twin.state
    close(state.mass_matrix(), twin.mass_matrix())
    close(state.bias_forces(), twin.P.T @ pin.nonLinearEffects(twin.pin, twin.data, twin.q, twin.v))
    close(state.inverse_dynamics(), twin.P.T @ pin.rnea(twin.pin, twin.data, twin.q, twin.v, twin.a))
    close(-state.gravity_forces(), twin.P.T @ pin.computeGeneralizedGravity(twin.pin, twin.data, twin.q))


@every_robot
def test_solves_are_alike(twin: Twin) -> None:
    """Of the rows that are free: those of followers are their leaders'."""
    state = twin.state
    M = twin.mass_matrix()
    free = np.diag(M) > 0
    if not np.any(twin.P != 0, axis=0).all():
        assert not free.all()
    f = M @ np.random.default_rng(3).uniform(-1, 1, twin.linden.nv)
    bias = twin.P.T @ pin.nonLinearEffects(twin.pin, twin.data, twin.q, twin.v)
    for found, right in ((state.solve_mass_matrix(f), f), (state.forward_dynamics(f), f - bias)):
        x = np.zeros(twin.linden.nv)
        x[free] = np.linalg.solve(M[np.ix_(free, free)], right[free])
        # a solve loses as many digits as the condition number has
        close(twin.P @ found, twin.P @ x, np.linalg.cond(M[np.ix_(free, free)]) * 1e-15 + ROUNDING)
    if free.all() and twin.pin.nv == twin.linden.nv:
        # every joint is one of its own in both: P only sorts rows
        articulated = pin.aba(twin.pin, twin.data, twin.q, twin.v, twin.P @ f)
        close(twin.P @ state.forward_dynamics(f), articulated, np.linalg.cond(M) * 1e-15 + ROUNDING)


@every_robot
def test_totals_are_alike(twin: Twin) -> None:
    state = twin.state
    com = state.centre_of_mass
    close(com.position, pin.centerOfMass(twin.pin, twin.data, twin.q, twin.v))
    close(com.velocity, twin.data.vcom[0])
    close(com.mass, pin.computeTotalMass(twin.pin))
    close(state.centre_of_mass_jacobian(), pin.jacobianCenterOfMass(twin.pin, twin.data, twin.q).reshape(3, twin.pin.nv) @ twin.P)
    h = pin.computeCentroidalMomentum(twin.pin, twin.data, twin.q, twin.v)
    close(state.centroidal_momentum.linear, h.linear)
    close(state.centroidal_momentum.angular, h.angular)
    close(state.momentum.linear, h.linear)
    close(state.momentum.angular, h.angular + np.cross(com.position, h.linear))
    A = pin.computeCentroidalMap(twin.pin, twin.data, twin.q) @ twin.P
    close(state.momentum_matrix()[3:], A[:3])


@every_robot
def test_reactions_are_alike(twin: Twin) -> None:
    """Frames of joints differ by a turn about their axes: what no turn changes is compared, and what goes along the axis."""
    pin.rnea(twin.pin, twin.data, twin.q, twin.v, twin.a)
    across = twin.state.joint_reactions()
    bodies = dict(zip(twin.linden.joints, across[1:], strict=True))
    on_world = np.zeros(6)
    for k in range(1, twin.pin.njoints):
        joint, f = twin.pin.joints[k], twin.data.f[k]
        if twin.pin.parents[k] == 0:
            at_origin = twin.data.oMi[k].act(f)
            on_world -= np.array([*at_origin.angular, *at_origin.linear])
        if joint.nv == 6:
            close(bodies[next(name for name, (_, v_rows) in twin.rows.items() if v_rows.stop - v_rows.start == 6)], angular_first(f))
            continue
        found = bodies[twin.pin.names[k]]
        S = np.asarray(twin.data.joints[k].S).reshape(6)
        axis = S[3:] if np.any(S[3:]) else S[:3]
        close(
            [np.linalg.norm(found[:3]), np.linalg.norm(found[3:]), found[:3] @ found[3:], found[2], found[5]],
            [np.linalg.norm(f.angular), np.linalg.norm(f.linear), f.angular @ f.linear, f.angular @ axis, f.linear @ axis],
        )
    close(across[0], on_world)
