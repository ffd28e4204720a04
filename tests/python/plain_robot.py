"""Places and inertias of a URDF file by definition: what linden's questions are compared with where no other library is there. It reads the
file by itself and knows of linden's conventions only which row of q is whose joint."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

import linden
from states import Array, rotation_of


class PlainRobot:
    """A URDF of hinges, sliders and fixed joints, some mimics of others, on a base that is fixed or floats by the joint "base"."""

    def __init__(self, text: str, floating: bool) -> None:
        self.robot = ElementTree.fromstring(text)
        self.floating = floating
        self.joints = self.robot.findall("joint")
        children = {joint.find("child").get("link") for joint in self.joints}
        self.root = next(link.get("name") for link in self.robot.findall("link") if link.get("name") not in children)

    def poses(self, model: linden.Model, q: Array) -> dict[str, tuple[Array, Array]]:
        """R, p of every link."""
        values = {name: q[k] for k, name in enumerate(model.q_names)}
        if self.floating:
            base = next(k for k, name in enumerate(model.q_names) if name.endswith(".x"))
            found = {self.root: (rotation_of(q[base + 3 : base + 7]), q[base : base + 3])}
        else:
            found = {self.root: (np.eye(3), np.zeros(3))}
        waiting = list(self.joints)
        while waiting:
            for joint in [j for j in waiting if j.find("parent").get("link") in found]:
                waiting.remove(joint)
                R, p = found[joint.find("parent").get("link")]
                R0, p0 = _origin(joint)
                R1, p1 = _moved(joint, values.get(joint.get("name"), 0.0))
                found[joint.find("child").get("link")] = (R @ R0 @ R1, p + R @ (p0 + R0 @ p1))
        return found

    def inertias(self) -> Iterator[tuple[str, float, Array, Array]]:
        """Of every link that has mass: name, mass, centre of mass, inertia about it; link's frame."""
        for link in self.robot.findall("link"):
            inertial = link.find("inertial")
            if inertial is None:
                continue
            R, p = _origin(inertial)
            entries = {key: float(inertial.find("inertia").get(key, 0)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
            xx, xy, xz, yy, yz, zz = entries.values()
            about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            yield link.get("name"), float(inertial.find("mass").get("value")), p, R @ about @ R.T


def _floats(text: str | None, usual: str) -> Array:
    return np.array([float(word) for word in (text or usual).split()])


def _origin(element: ElementTree.Element) -> tuple[Array, Array]:
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = _floats(origin.get("rpy"), "0 0 0")
    R = turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch) @ turn([1, 0, 0], roll)
    return R, _floats(origin.get("xyz"), "0 0 0")


def turn(axis: Array | list[int], angle: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def _moved(joint: ElementTree.Element, value: float) -> tuple[Array, Array]:
    axis = joint.find("axis")
    along = _floats(axis.get("xyz") if axis is not None else None, "1 0 0")
    match joint.get("type"):
        case "revolute" | "continuous":
            return turn(along, value), np.zeros(3)
        case "prismatic":
            return np.eye(3), value * along / np.linalg.norm(along)
        case _:
            return np.eye(3), np.zeros(3)
