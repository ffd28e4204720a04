#!/usr/bin/env python3
"""What linden costs from Python, and beside mujoco.batch: the same robot in both, checked before it is timed.

    pip install . mujoco
    python bench/python.py [--instances 1024] [--seconds 2] [--robots ../shared/robots] [--program build/release/linden]

Rollouts: a floating robot, free and held upright on the ground by servos, 20 steps of 1 ms to a call, with q, v and 10 link poses read after
each. MuJoCo reads the robot's URDF itself; its bodies touch the ground alone, as linden's do, its servos are position actuators and
its integrator is implicitfast. Overheads: batch.step(1), sim.step() and observations against the same steps without them. What is compared
takes turns, and the median of the turns stands. Figures are of a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import linden

ROOT = Path(__file__).resolve().parents[1]
STEP, SUBSTEPS, CALLS = 1e-3, 20, 2
STIFFNESS, DAMPING, ARMATURE = 2000.0, 100.0, 0.01
LINKS = 10
SETTLING = 500
BENT = {f"{side}_{joint}_pitch": angle for side in ("left", "right") for joint, angle in (("hip", -0.2), ("knee", 0.4), ("ankle", -0.2))}
STANDING = 0.91  # [m] of the pelvis, soles on the ground

try:
    import mujoco
    from mujoco import batch as mujoco_batch
except ImportError:
    mujoco = None


class Case:
    """A robot, free or on the ground: scene, start and MuJoCo's model of it."""

    def __init__(self, file: Path, ground: bool) -> None:
        self.file, self.ground = file, ground
        text = re.sub(r"<!--.*?-->", "", file.read_text(), flags=re.DOTALL)
        text = re.sub(r"<(visual|collision)>(?:(?!</\1>).)*<mesh(?:(?!</\1>).)*</\1>", "", text, flags=re.DOTALL)
        self.model = linden.parse_urdf(text, base="floating")
        effects: dict[str, Any] = {"gravity": [0, 0, -9.81]}
        if ground:
            effects |= {"armature": ARMATURE, "servo": {"stiffness": STIFFNESS, "damping": DAMPING, "max_force": "none"}}
            effects |= {"ground": {"stiffness": 1e5, "damping": 500, "friction": 0.8}}
        initial = {"base": {"position": [0, 0, STANDING]}, "positions": BENT} if ground else {}
        self.scene = linden.scene(self.model, step=STEP, initial=initial, effects=effects)
        self.links = self.model.bodies[:: max(1, len(self.model.bodies) // LINKS)][:LINKS]
        self.observe = ["q", "v", *(f"pose:{link}" for link in self.links)]
        self.text = text

    def starts(self, instances: int) -> np.ndarray:
        """q of every instance: joints a little apart from each other."""
        q = np.tile(self.scene.q, (instances, 1))
        q[:, 7:] += np.random.default_rng(1).uniform(-0.02, 0.02, (instances, self.model.nq - 7))
        return q

    def linden(self, instances: int, **options: Any) -> linden.Batch:
        batch = linden.Batch(self.scene, instances, **{"observe": self.observe, **options})
        batch.reset(q=self.starts(instances))
        return batch

    def mujoco_model(self) -> Any:
        text = self.text
        if not re.search(r'type="floating"', text):
            root = self.model.bodies[0]
            base = f'<link name="world_of_it"/><joint name="base" type="floating"><parent link="world_of_it"/><child link="{root}"/></joint>'
            text = text.replace("</robot>", base + "</robot>")
        spec = mujoco.MjSpec.from_string(text)
        spec.option.timestep = STEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        for geom in spec.geoms:
            geom.contype, geom.conaffinity = (1, 0) if self.ground else (0, 0)
        for joint in spec.joints:
            joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
            joint.damping, joint.frictionloss = 0 * joint.damping, 0
            joint.armature = ARMATURE if self.ground and joint.type != mujoco.mjtJoint.mjJNT_FREE else 0
        if self.ground:
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=0, conaffinity=1, friction=[0.8, 0.005, 0.0001])
            for joint in self.scene.servos:
                actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
                actuator.set_to_position(kp=STIFFNESS, kv=DAMPING)
        return spec.compile()

    def mujoco(self, model: Any, instances: int, threads: int) -> Any:
        """Its batch at the same start, with what is observed bound."""
        batch = mujoco_batch.Batch(model, instances, threads)
        for field in ("qpos", "qvel", "xpos", "xquat"):
            batch.bind(field)
        qpos, q = batch.bind("qpos"), self.starts(instances)
        base, rows = model.joint(_free(model)).qposadr[0], self.model.q_names
        qpos[:, base : base + 3] = q[:, 0:3]
        qpos[:, base + 3 : base + 7] = q[:, [6, 3, 4, 5]]
        for k, name in enumerate(rows[7:], 7):
            qpos[:, model.joint(name).qposadr[0]] = q[:, k]
        if self.ground:
            for k, name in enumerate(self.scene.servos):
                batch.bind("ctrl")[:, k] = self.scene.q[rows.index(name)]
        batch.forward()
        return batch


def _free(model: Any) -> int:
    return next(k for k in range(model.njnt) if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_FREE)


def check(case: Case) -> Any:
    """The two are the same robot at the same place and move alike; the model of MuJoCo."""
    model = case.mujoco_model()
    assert model.nv == case.model.nv, (model.nv, case.model.nv)
    assert abs(model.body_mass.sum() - case.model.mass) < 1e-9 * case.model.mass
    ours, theirs = case.linden(4), case.mujoco(model, 4, 1)

    def apart() -> float:
        theirs.forward()  # places of the state, not of the step before
        found = [np.abs(ours.observations[:, ours.layout[f"pose:{link}"].slice][:, :3] - theirs.bind("xpos")[:, model.body(link).id]).max()
                 for link in case.links]  # fmt: skip
        return float(max(found))

    assert apart() < 1e-12, apart()
    ours.step(100 if not case.ground else 1000)
    theirs.step(nstep=100 if not case.ground else 1000)
    # free: two integrators of the first and second order over 0.1 s; on the ground: two laws of contact, both upright
    assert not ours.failed.any() and apart() < (1e-3 if not case.ground else 0.02), apart()
    return model


def equal_bits(make: Callable[[int], Any], advance: Callable[[Any], np.ndarray]) -> bool:
    first, *others = (advance(make(threads)) for threads in (1, 2, 3))
    return all(np.array_equal(first, other) for other in others)


def turns(works: dict[str, Callable[[], object]], seconds: float) -> dict[str, float]:
    """Seconds that each takes, the median of turns that take `seconds` together, some at least."""
    for work in works.values():
        work()
    taken: dict[str, list[float]] = {name: [] for name in works}
    end = time.perf_counter() + seconds * len(works)
    while time.perf_counter() < end or len(taken[next(iter(works))]) < 3:
        for name, work in works.items():
            begin = time.perf_counter()
            work()
            taken[name].append(time.perf_counter() - begin)
    return {name: statistics.median(all_of_it) for name, all_of_it in taken.items()}


def rollouts(case: Case, instances: int, seconds: float) -> None:
    model = check(case) if mujoco else None
    batches: dict[str, Any] = {"linden": case.linden(instances), "linden float32": case.linden(instances, dtype="float32")}
    q = case.starts(instances)
    if case.ground:
        for batch in batches.values():
            batch.step(SETTLING)  # then it stands, and goes on standing

    def ours(name: str) -> None:
        if not case.ground:
            batches[name].reset(q=q)
        for _ in range(CALLS):
            batches[name].step(SUBSTEPS)
        if batches[name].failed.any():
            raise SystemExit(f"{name}: {batches[name].describe(int(np.flatnonzero(batches[name].failed)[0]))}")

    works: dict[str, Callable[[], object]] = {name: lambda name=name: ours(name) for name in batches}  # type: ignore[misc]
    bits = {"linden": equal_bits(lambda threads: case.linden(64, threads=threads), lambda b: [b.step(100), b.q][1])}
    bits["linden float32"] = equal_bits(lambda threads: case.linden(64, threads=threads, dtype="float32"), lambda b: [b.step(100), b.q][1])
    if mujoco:
        name = f"MuJoCo {mujoco.__version__}"
        theirs = case.mujoco(model, instances, 0)
        start = theirs.state.copy()
        if case.ground:
            theirs.step(nstep=SETTLING)

        def other() -> None:
            if not case.ground:
                theirs.state[:] = start
            for _ in range(CALLS):
                theirs.step(nstep=SUBSTEPS)

        works[name] = other
        bits[name] = equal_bits(lambda threads: case.mujoco(model, 64, threads), lambda b: [b.step(nstep=100), b.state.copy()][1])
    taken = turns(works, seconds)
    slowest = max(taken.values())
    print(f"\n{case.model.name}, {'on the ground under PD control' if case.ground else 'free'}, {instances} instances, {case.model.nv} DOF\n")
    print("| | env-steps/s with observations | of the slowest | equal bits with 1, 2, 3 threads |\n| --- | --- | --- | --- |")
    for name, time_of in taken.items():
        print(f"| {name} | {instances * CALLS * SUBSTEPS / time_of:,.0f} | {slowest / time_of:.1f} | {'yes' if bits[name] else 'no'} |")


def memory(file: Path, instances: int) -> None:
    """What a process grows by, each in one of its own."""
    print(f"\nmemory of {instances} instances with observations\n\n| | MiB |\n| --- | --- |")
    for name in ["linden", "linden float32"] + (["mujoco"] if mujoco else []):
        done = subprocess.run([sys.executable, __file__, "--grow", name, "--file", str(file), "--instances", str(instances)],
                              capture_output=True, text=True, check=True)  # fmt: skip
        print(f"| {name} | {int(done.stdout) / 2**20:.1f} |")


def grow(name: str, file: Path, instances: int) -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    case = Case(file, ground=False)
    model = case.mujoco_model() if name == "mujoco" else None
    case.starts(instances)
    before = resident()
    if model is not None:
        kept: Any = case.mujoco(model, instances, 0)
        kept.step(nstep=2)
    else:
        kept = case.linden(instances, dtype="float32" if "float32" in name else "float64")
        kept.step(2)
    print(resident() - before)


def overheads(file: Path, instances: int, seconds: float, program: str | None) -> None:
    case = Case(file, ground=False)
    bare = case.linden(instances, observe=())

    def again(batch: linden.Batch, calls: int, n: int) -> None:
        for _ in range(calls):
            batch.step(n)

    found = turns({"one": lambda: again(bare, 20, 1), "many": lambda: again(bare, 1, 20), "none": lambda: again(bare, 1000, 0)}, seconds)
    print(f"\noverheads\n\n| | | |\n| --- | --- | --- |\n| batch.step(1), {instances} {case.model.name} | {found['one'] / 20 * 1e3:.3f} ms "
          f"| {found['one'] / found['many']:.3f} times a step of step(20) |")  # fmt: skip
    print(f"| the call alone, batch.step(0) | {found['none'] * 1e3:.2f} µs | {100 * found['none'] / 1000 / (found['one'] / 20):.2f} % of batch.step(1) |")
    if program:
        with tempfile.TemporaryDirectory() as folder:
            command = [program, "rollout", str(file), "--base", "floating", "--instances", str(instances), "--duration", "0.5", "--spread", "0.02",
                       "--json", f"{folder}/figures.json"]  # fmt: skip
            subprocess.run(command, check=True, capture_output=True)
            rate = json.loads(Path(folder, "figures.json").read_text())["env_steps_per_second"]
        print(f"| the program, one rollout | {instances / rate * 1e3:.3f} ms | {found['one'] / 20 / (instances / rate):.3f} times |")

    sim = linden.Simulation("chain:1")
    steps = 5000

    def alone() -> None:
        for _ in range(steps):
            sim.step()

    found = turns({"step": alone, "run": lambda: sim.run(steps)}, seconds)
    print(f"| sim.step(), chain:1 | {found['step'] / steps * 1e6:.2f} µs | {(found['step'] - found['run']) / steps * 1e6:.2f} µs more than a step of run |")

    many = Case(ROOT / "models" / "humanoid.urdf", ground=False)
    seen, unseen = many.linden(4096), many.linden(4096, observe=())
    for n in (1, 20):
        found = turns({"seen": lambda: again(seen, 20 // n, n), "unseen": lambda: again(unseen, 20 // n, n)}, seconds)
        print(f"| q, v, {LINKS} poses of 4096 humanoids, step({n}) | {found['seen'] * n / 20 * 1e3:.2f} ms | "
              f"{100 * (found['seen'] / found['unseen'] - 1):.1f} % more than without |")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=1024)
    parser.add_argument("--seconds", type=float, default=2.0, help="that each figure takes")
    parser.add_argument("--robots", type=Path, default=ROOT.parent / "shared" / "robots", help="where g1_29dof.urdf may be")
    parser.add_argument("--program", help="linden, of the same build, for its rollouts")
    parser.add_argument("--grow", help=argparse.SUPPRESS)
    parser.add_argument("--file", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", linden.InputWarning)
    if arguments.grow:
        return grow(arguments.grow, arguments.file, arguments.instances)
    humanoid, g1 = ROOT / "models" / "humanoid.urdf", arguments.robots / "g1_29dof.urdf"
    robot = g1 if g1.exists() else humanoid
    print(f"linden {linden.__version__}, {linden.best_instructions()}, Python {platform.python_version()}, {os.cpu_count()} processors")
    if not mujoco:
        print("no MuJoCo: linden alone")
    rollouts(Case(robot, ground=False), arguments.instances, arguments.seconds)
    rollouts(Case(humanoid, ground=True), arguments.instances, arguments.seconds)
    memory(robot, 4 * arguments.instances)
    overheads(robot, arguments.instances, arguments.seconds, arguments.program)


if __name__ == "__main__":
    main()
