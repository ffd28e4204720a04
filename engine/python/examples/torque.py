"""Drive an arm by torque: computed torque control makes it follow a path, by inverse dynamics of what it should do next.

    python engine/python/examples/torque.py
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"
STEP = 1e-3
STIFFNESS = 400.0  # [1/s^2], of the error: it dies down within some 0.2 s
DAMPING = 2 * np.sqrt(STIFFNESS)


def path(t: float, joints: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Where, how fast and with which acceleration the joints should be [rad, s]."""
    beat = 2.0 + 0.3 * np.arange(joints)
    return 0.5 * np.sin(beat * t), 0.5 * beat * np.cos(beat * t), -0.5 * beat**2 * np.sin(beat * t)


def follow(seconds: float = 2.0) -> float:
    """The largest error at the end [rad], from a start that is at rest."""
    sim = linden.Simulation(MODELS / "arm.urdf", step=STEP)
    largest = 0.0
    for _ in range(round(seconds / STEP)):
        q, v, a = path(sim.time, sim.model.nv)
        wanted = a + STIFFNESS * (q - sim.q) + DAMPING * (v - sim.v)
        sim.forces = sim.inverse_dynamics(wanted)
        sim.step()
        if sim.time > seconds / 2:
            largest = max(largest, float(np.abs(path(sim.time, sim.model.nv)[0] - sim.q).max()))
    return largest


if __name__ == "__main__":
    print(f"largest error once it has caught up: {follow():.2e} rad")
