"""Domain randomisation by name: masses, gains, friction and gravity of every instance, set from arrays, and how low each lands.

    python engine/python/examples/randomize.py
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"


def sink(instances: int = 64) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Masses of the trunk [kg] and heights of the pelvis after 0.3 s, as it lands [m]."""
    scene = linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml")
    batch = linden.Batch(scene, instances, observe=["position:pelvis"])
    rng = np.random.default_rng(0)
    masses = batch.get("mass:thorax") * np.linspace(0.5, 2.0, instances)
    batch.set("mass:thorax", masses)
    batch.set("ground_friction", rng.uniform(0.6, 1.0, instances))
    for joint in ("left_knee_pitch", "right_knee_pitch"):
        batch.set(f"gain:{joint}", 0.3)
    batch.set("gravity", [0.0, 0.0, -9.81])
    batch.reset()  # masses keep momenta: they are set before
    batch.step(300)
    return masses, batch.observations[:, 2].copy()


if __name__ == "__main__":
    masses, heights = sink()
    for k in range(0, len(masses), 9):
        print(f"thorax of {masses[k]:5.2f} kg: pelvis at {heights[k]:.4f} m")
