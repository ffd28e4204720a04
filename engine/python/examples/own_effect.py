"""An effect of your own: a spring with a damper between the hand of an arm and a fixed point, J^T f of the hand's Jacobian as forces.

    python engine/python/examples/own_effect.py
"""

from pathlib import Path

import numpy as np

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"
HAND = "tool_flange"
ANCHOR = np.array([0.5, 0.2, 0.6])  # [m]
STIFFNESS, DAMPING = 300.0, 30.0  # [N/m, N s/m]


def pull(seconds: float = 3.0) -> linden.Simulation:
    sim = linden.Simulation(MODELS / "arm.urdf", step=1e-3, effects={"damping": 2.0})
    while sim.time < seconds:
        hand, velocity = sim.pose(HAND).position, sim.twist(HAND)[3:]
        force = STIFFNESS * (ANCHOR - hand) - DAMPING * velocity
        sim.forces = sim.jacobian(HAND)[3:].T @ force
        sim.step()
    return sim


if __name__ == "__main__":
    print(f"the hand is {np.linalg.norm(pull().pose(HAND).position - ANCHOR):.2e} m from where the spring is fixed")
