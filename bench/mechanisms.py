#!/usr/bin/env python3
"""A leg whose knee is driven through a loop, in linden and in MuJoCo: gap, energy and time in one run.

    pip install . mujoco
    python bench/mechanisms.py [--instances 1024] [--seconds 10] [--threads 0]

models/leg.urdf, let go from a bent pose, without damping, friction and limits, swings for some seconds at 1 ms. linden closes the pin of rod and
shank by five rows, MuJoCo by `connect` (three, which leave the same freedom in this plane), soft as it is by default and as stiff as its manual
lets it be (solref of two steps, solimp 0.9999), by its default integrator and by RK4. Told are the widest gap of the pin, how far energy strays
beside the largest kinetic energy, and the time of a step; then a batch of legs, no two alike, on all threads. What is compared
takes turns, and the median of the turns stands.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import batch as mujoco_batch

import linden

FILE = Path(__file__).resolve().parents[1] / "models" / "leg.urdf"
STEP = 1e-3
BENT = {"hip": 0.3, "thigh": 0.5, "knee": -0.9, "crank": -0.4, "rod": 0.9}  # knee = crank - thigh, rod = thigh - crank
ROD_END, LEVER = np.array([0, 0, -0.2]), np.array([-0.024, -0.022, 0.032])  # of the rod, of the shank
STIFFEST = {"solref": [2 * STEP, 1], "solimp": [0.9999, 0.9999, 0.001, 0.5, 2]}


def scene() -> linden.Scene:
    return linden.scene(linden.load(FILE), step=STEP, initial={"positions": BENT}, effects={"gravity": [0, 0, -9.81]})


def mujoco_model(stiffest: bool, integrator: Any) -> Any:
    text = FILE.read_text()
    for left_out in (r"<!--.*?-->", r"<(visual|collision)>.*?</\1>", r"<loop_joint.*?</loop_joint>"):
        text = re.sub(left_out, "", text, flags=re.DOTALL)
    spec = mujoco.MjSpec.from_string(text)
    spec.option.timestep, spec.option.integrator = STEP, integrator
    spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    for joint in spec.joints:
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        joint.damping, joint.frictionloss = 0 * joint.damping, 0
    pin = spec.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY, name1="rod", name2="shank")
    pin.data[:3] = ROD_END
    if stiffest:
        pin.solref[:], pin.solimp[:] = STIFFEST["solref"], STIFFEST["solimp"]
    return spec.compile()


def bent(model: Any) -> np.ndarray:
    q = np.zeros(model.nq)
    for joint, angle in BENT.items():
        q[model.joint(joint).qposadr[0]] = angle
    return q


def swing_linden(seconds: float) -> tuple[float, float, float]:
    sim = linden.Simulation(scene())
    gap, energies, kinetic, spent = 0.0, [sim.energy.total], 0.0, 0.0
    for _ in range(round(seconds / STEP) // 10):
        begin = time.perf_counter()
        sim.run(10)
        spent += time.perf_counter() - begin
        energy = sim.energy
        gap = max(gap, np.abs(sim.couplings[0].gaps[:3]).max())
        energies.append(energy.total)
        kinetic = max(kinetic, energy.kinetic)
    return gap, float(np.abs(np.array(energies) - energies[0]).max() / kinetic), spent / (10 * (len(energies) - 1))


def swing_mujoco(seconds: float, model: Any) -> tuple[float, float, float]:
    data = mujoco.MjData(model)
    data.qpos[:] = bent(model)
    mujoco.mj_forward(model, data)
    rod, shank = model.body("rod").id, model.body("shank").id
    gap, energies, kinetic, spent = 0.0, [data.energy.sum()], 0.0, 0.0
    for _ in range(round(seconds / STEP) // 10):
        begin = time.perf_counter()
        for _ in range(10):
            mujoco.mj_step(model, data)
        spent += time.perf_counter() - begin
        mujoco.mj_forward(model, data)
        ends = [data.xpos[body] + data.xmat[body].reshape(3, 3) @ at for body, at in ((rod, ROD_END), (shank, LEVER))]
        gap = max(gap, float(np.linalg.norm(ends[0] - ends[1])))
        energies.append(data.energy.sum())
        kinetic = max(kinetic, data.energy[1])
    return gap, float(np.abs(np.array(energies) - energies[0]).max() / kinetic), spent / (10 * (len(energies) - 1))


def check(model: Any) -> None:
    """The two are the same leg, and move alike for a tenth of a second: MuJoCo's as RK4 has it, its pin as stiff as it can be."""
    sim, data = linden.Simulation(scene()), mujoco.MjData(model)
    assert abs(model.body_mass.sum() - sim.model.mass) < 0.5 * sim.model.mass  # the trunk is fixed to the world there
    data.qpos[:] = bent(model)
    mujoco.mj_forward(model, data)
    assert abs(sim.energy.kinetic) < 1e-12
    sim.run(100)
    for _ in range(100):
        mujoco.mj_step(model, data)
    for joint in BENT:
        apart = abs(sim.q[sim.model.q_names.index(joint)] - data.qpos[model.joint(joint).qposadr[0]])
        assert apart < 2e-3, (joint, apart)


def batches(instances: int, threads: int, model: Any) -> dict[str, float]:
    """Steps of instances a second."""
    turned = np.random.default_rng(1).uniform(-0.3, 0.3, (instances, 2))
    ours = linden.Batch(scene(), instances, threads=threads, observe=["q", "v"])
    q = np.tile(scene().q, (instances, 1))
    names = scene().model.q_names
    for k, joint in enumerate(("hip", "thigh")):
        q[:, names.index(joint)] += turned[:, k]
    for joint, sign in (("knee", -1), ("rod", 1)):  # the crank stays
        q[:, names.index(joint)] += sign * turned[:, 1]
    ours.reset(q=q)
    theirs = mujoco_batch.Batch(model, instances, threads)
    qpos = theirs.bind("qpos")
    for joint in BENT:
        qpos[:, model.joint(joint).qposadr[0]] = q[:, names.index(joint)]
    theirs.bind("qvel")
    theirs.forward()
    works: dict[str, Callable[[], object]] = {"linden": lambda: ours.step(20), "mujoco": lambda: theirs.step(nstep=20)}
    spent: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()
    for _ in range(9):
        for name, work in works.items():
            begin = time.perf_counter()
            work()
            spent[name].append(time.perf_counter() - begin)
    assert not ours.failed.any()
    return {name: 20 * instances / statistics.median(times) for name, times in spent.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=1024)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--threads", type=int, default=0, help="0: all")
    options = parser.parse_args()
    euler, rk4 = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4
    check(mujoco_model(True, rk4))
    print(f"linden {linden.__version__}, MuJoCo {mujoco.__version__}; {options.seconds:g} s at {1e3 * STEP:g} ms")
    print(f"{'':34}{'widest gap [m]':>16}{'energy strays':>16}{'a step [us]':>14}")
    rows = [("linden", lambda: swing_linden(options.seconds))]
    for name, stiffest, integrator in (("MuJoCo", False, euler), ("MuJoCo, stiffest", True, euler), ("MuJoCo, stiffest, RK4", True, rk4)):
        rows.append((name, lambda s=stiffest, i=integrator: swing_mujoco(options.seconds, mujoco_model(s, i))))
    for name, row in rows:
        gap, strays, spent = row()
        print(f"{name:34}{gap:16.1e}{strays:16.1e}{1e6 * spent:14.2f}")
    threads = options.threads or os.cpu_count() or 1
    for name, stiffest in (("soft", False), ("stiffest", True)):
        rates = batches(options.instances, threads, mujoco_model(stiffest, euler))
        print(f"{options.instances} legs, {threads} threads, MuJoCo's pin {name}: {rates['linden']:.3g} and {rates['mujoco']:.3g} steps/s, ratio {rates['linden'] / rates['mujoco']:.2f}")


if __name__ == "__main__":
    main()
