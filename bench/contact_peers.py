#!/usr/bin/env python3
"""How far what friction holds creeps, and what a step of it takes, in linden and in MuJoCo in one run.

    pip install . mujoco
    python bench/contact_peers.py [--grasp 600] [--slope 60] [--stand 60]

Three cases, each read from one URDF text by both, with the same masses, shapes, friction of 0.8 and steps of 1 ms; that both have the same masses
and begin at the same places is checked first.

    grasp   two fingers on slides, servos of 2,000 N/m and 50 N s/m, press a box of 0.5 kg by 5 N each, which gravity pulls down between them: friction
            bears 0.61 of what it can. Told is how far the box sinks.
    slope   a box on a slope at 0.9 of the angle at which it would slide. Told is how far it goes.
    stand   the humanoid stands by its servos. Told is how far its feet go, the farther of the two.

All from the first second on, when the servos have come to rest, to the end, and the speed over the last tenth of the time; a box that has sunk out of
the grasp is lost. linden's contact is rigid, as it is by default, and the humanoid stands on its ground too. MuJoCo is taken as it is by default, with
its elliptic cone and an impratio of 100, and with ten iterations of NoSlip. All take turns, a second of the motion each; of the processor times of a
step the median stands.
"""

from __future__ import annotations

import argparse
import math
import re
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import linden

HUMANOID = Path(__file__).resolve().parents[1] / "models" / "humanoid.urdf"
STEP, FRICTION, GRAVITY = 1e-3, 0.8, [0, 0, -9.81]
GRIP = 5.0  # [N]
SLOPE = 0.9 * math.atan(FRICTION)
BENT = {f"{side}_{joint}_pitch": angle for side in ("left", "right") for joint, angle in (("hip", -0.2), ("knee", 0.4), ("ankle", -0.2))}
STANDING = 0.91  # [m] of the pelvis, soles on the ground
ELLIPTIC, NO_SLIP = {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC}, {"noslip_iterations": 10}
VARIANTS: dict[str, dict[str, Any]] = {
    "MuJoCo": {},
    "MuJoCo, NoSlip": NO_SLIP,
    "MuJoCo, elliptic, NoSlip": ELLIPTIC | NO_SLIP,
    "MuJoCo, elliptic, impratio 100": ELLIPTIC | {"impratio": 100},
    "MuJoCo, elliptic, impratio 100, NoSlip": ELLIPTIC | {"impratio": 100} | NO_SLIP,
}


@dataclass
class Case:
    """What both engines are made of; places and sizes in metres."""

    name: str
    text: str  # the URDF
    base: str
    watched: list[str]  # links
    stiffness: float = 0  # of the servos [N/m or N m/rad]
    damping: float = 0
    targets: dict[str, float] = field(default_factory=dict)
    armature: float = 0
    positions: dict[str, float] = field(default_factory=dict)
    base_position: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    base_pitch: float = 0
    floor: dict[str, Any] | None = None  # a box of linden's world
    touching: list[list[str]] = field(default_factory=list)  # pairs of links
    lost: float = math.inf  # what went so far [m] is no longer held

    def linden(self, ground: bool = False) -> linden.Simulation:
        effects: dict[str, Any] = {"gravity": GRAVITY}
        if self.armature:
            effects["armature"] = self.armature
        if self.stiffness:
            effects["servo"] = {"stiffness": self.stiffness, "damping": self.damping, "max_force": "none"}
            if self.targets:
                effects["servo"] |= {"joints": list(self.targets), "targets": self.targets}
        initial: dict[str, Any] = {"positions": self.positions} if self.positions else {}
        if self.base == "floating":
            initial["base"] = {"position": self.base_position, "rotation": [0, self.base_pitch, 0]}
        settings: dict[str, Any] = {"step": STEP, "initial": initial, "effects": effects}
        if ground:
            effects["ground"] = {"stiffness": 1e5, "damping": 500, "friction": FRICTION}
        else:
            effects["contact"] = {"friction": FRICTION, "pairs": self.touching}
            if self.floor:
                settings["world"] = [self.floor]
        return linden.Simulation(linden.parse_urdf(self.text, base=self.base), **settings)

    def mujoco(self, options: dict[str, Any]) -> tuple[Any, Any]:
        """Its model, and data at the start."""
        text = self.text
        if self.base == "floating":
            root = linden.parse_urdf(text, base=self.base).bodies[0]
            joint = f'<link name="world_of_it"/><joint name="base" type="floating"><parent link="world_of_it"/><child link="{root}"/></joint>'
            text = text.replace("</robot>", joint + "</robot>")
        spec = mujoco.MjSpec.from_string(text)
        spec.option.timestep, spec.option.gravity = STEP, GRAVITY
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST  # servos as stiff as the humanoid's want it
        for name, value in options.items():
            setattr(spec.option, name, value)
        touched = {link for pair in self.touching for link in pair}
        for geom in spec.geoms:  # each touches what it is not itself: with a floor bodies and the floor, without one each other
            geom.contype, geom.conaffinity = (1, 0 if self.floor else 1) if geom.parent.name in touched else (0, 0)
            geom.friction[0] = FRICTION
        for joint in spec.joints:
            joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
            joint.damping, joint.frictionloss = 0 * joint.damping, 0
            joint.armature = self.armature if joint.type != mujoco.mjtJoint.mjJNT_FREE else 0
        if self.floor:
            size, pose = [0.5 * edge for edge in self.floor["size"]], {"pos": self.floor["position"], "quat": turned(self.base_pitch)}
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, contype=0, conaffinity=1, friction=[FRICTION, 0.005, 0.0001], **pose)
        servos = (self.targets or self.linden().scene.servos) if self.stiffness else []
        for name in servos:
            spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_position(kp=self.stiffness, kv=self.damping)
        model = spec.compile()
        data = mujoco.MjData(model)
        for name, value in self.positions.items():
            data.qpos[model.joint(name).qposadr[0]] = value
        if self.base == "floating":
            data.qpos[model.joint("base").qposadr[0] :][:7] = [*self.base_position, *turned(self.base_pitch)]
        for k, name in enumerate(servos):
            data.ctrl[k] = self.targets.get(name, self.positions.get(name, 0))
        mujoco.mj_kinematics(model, data)
        return model, data


def turned(pitch: float) -> list[float]:
    return [math.cos(0.5 * pitch), 0, math.sin(0.5 * pitch), 0]


def solid(name: str, mass: float, size: tuple[float, float, float]) -> str:
    inertia = [mass / 12 * (sum(edge**2 for edge in size) - size[axis] ** 2) for axis in range(3)]
    moments = " ".join(f'{key}="{value}"' for key, value in zip(("ixx", "iyy", "izz"), inertia, strict=True))
    return (f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>'
            f'<collision><geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry></collision></link>')  # fmt: skip


def grasp() -> Case:
    width, thickness, pressed = 0.06, 0.02, GRIP / 2000
    joints = ""
    for name, side in (("left", -1), ("right", 1)):
        joints += f'<joint name="{name}" type="prismatic"><parent link="frame"/><child link="{name}_finger"/><axis xyz="{-side} 0 0"/>'
        joints += f'<origin xyz="{side * 0.5 * (width + thickness)} 0 0"/><limit lower="-1" upper="1" effort="1000" velocity="10"/></joint>'
    joints += '<joint name="free" type="floating"><parent link="frame"/><child link="box"/></joint>'
    links = '<link name="frame"/>' + solid("box", 0.5, (width, width, width))
    links += "".join(solid(f"{name}_finger", 0.2, (thickness, 0.03, 0.03)) for name in ("left", "right"))
    touching = [["left_finger", "box"], ["right_finger", "box"]]
    targets = {"left": pressed, "right": pressed}
    return Case("grasp", f'<robot name="grasp">{links}{joints}</robot>', "fixed", ["box"], 2000, 50, targets, touching=touching,
                lost=0.5 * (width + 0.03))  # fmt: skip


def slope() -> Case:
    size, normal = (0.2, 0.2, 0.1), [math.sin(SLOPE), 0, math.cos(SLOPE)]
    floor = {"type": "box", "name": "slope", "size": [20, 2, 0.2], "position": [-0.1 * x for x in normal], "rotation": [0, SLOPE, 0]}
    return Case("slope", f'<robot name="box">{solid("box", 4, size)}</robot>', "floating", ["box"], base_position=[0.05 * x for x in normal],
                base_pitch=SLOPE, floor=floor, touching=[["box", "world/slope"]])  # fmt: skip


def stand() -> Case:
    text = re.sub(r"<!--.*?-->|<visual>.*?</visual>", "", HUMANOID.read_text(), flags=re.DOTALL)
    floor = {"type": "box", "name": "floor", "size": [4, 4, 0.2], "position": [0, 0, -0.1]}
    feet = ["left_foot", "right_foot"]
    return Case("stand", text, "floating", feet, 2000, 100, armature=0.01, positions=BENT, base_position=[0, 0, STANDING], floor=floor,
                touching=[[foot, "world/floor"] for foot in feet])  # fmt: skip


class Contender:
    """One of those that take turns: where what is watched has been at the end of each turn, and how long turns took."""

    def __init__(self, name: str, lost: float, run: Callable[[int], None], places: Callable[[], np.ndarray]) -> None:
        self.name, self.lost, self.run, self.read = name, lost, run, places
        self.places, self.spent, self.ended = [places()], list[float](), ""

    def turn(self, steps: int) -> None:
        if self.ended:
            return
        begin = time.process_time()
        try:
            self.run(steps)
        except linden.StepError as error:
            self.ended = str(error)
            return
        self.spent.append((time.process_time() - begin) / steps)
        self.places.append(self.read())
        if not np.linalg.norm(self.places[-1] - self.places[0], axis=1).max() < self.lost:
            self.ended = f"lost after {len(self.spent)} s"


def contenders(case: Case) -> list[Contender]:
    made = []
    for name, ground in (("linden", False), ("linden, on its ground", True)):
        if ground and case.name != "stand":
            continue
        sim = case.linden(ground)
        made.append(Contender(name, case.lost, sim.run, lambda sim=sim: np.array([sim.pose(link).position for link in case.watched])))
    mass = sim.model.mass
    for name, options in VARIANTS.items():
        model, data = case.mujoco(options)
        assert abs(model.body_mass.sum() - mass) < 1e-9 * mass, (model.body_mass.sum(), mass)

        def places(model: Any = model, data: Any = data) -> np.ndarray:
            mujoco.mj_kinematics(model, data)
            return np.array([data.body(link).xpos for link in case.watched])

        made.append(Contender(name, case.lost, lambda steps, model=model, data=data: mujoco.mj_step(model, data, steps), places))
        assert np.abs(made[-1].places[0] - made[0].places[0]).max() < 1e-12, (name, made[-1].places[0], made[0].places[0])
    return made


def measure(case: Case, seconds: int) -> None:
    all_of_them = contenders(case)
    for _ in range(seconds):
        for each in all_of_them:
            each.turn(round(1 / STEP))
    print(f"\n{case.name}, {seconds} s at {1e3 * STEP:g} ms\n\n| | went [m] | at the end [m/s] | a step [us] | beside linden |\n| --- | --- | --- | --- | --- |")
    last = max(1, seconds // 10)
    for each in all_of_them:
        spent = statistics.median(each.spent)
        times = f"{1e6 * spent:.1f} | {spent / statistics.median(all_of_them[0].spent):.2f}"
        if each.ended:
            print(f"| {each.name} | {each.ended} | | {times} |")
            continue
        went, lately = (np.linalg.norm(each.places[-1] - each.places[begin], axis=1).max() for begin in (1, -1 - last))
        print(f"| {each.name} | {went:.1e} | {lately / last:.1e} | {times} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, seconds in (("grasp", 600), ("slope", 60), ("stand", 60)):
        parser.add_argument(f"--{name}", type=int, default=seconds, help=f"seconds of that case, {seconds} where it is not given; 0: not at all")
    options = parser.parse_args()
    print(f"linden {linden.__version__}, MuJoCo {mujoco.__version__}")
    for case, seconds in ((grasp(), options.grasp), (slope(), options.slope), (stand(), options.stand)):
        if seconds:
            measure(case, seconds)


if __name__ == "__main__":
    main()
