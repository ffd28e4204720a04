"""A policy in the loop: a small network of NumPy acts on what it sees of some hundred humanoids at 50 Hz; between its acts linden
takes 20 steps, and those that have fallen begin again.

    python engine/python/examples/policy.py
"""

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"


def act(seen: NDArray[np.float64], layers: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    for layer in layers[:-1]:
        seen = np.tanh(seen @ layer)
    acts: NDArray[np.float64] = 0.2 * np.tanh(seen @ layers[-1])
    return acts


def run(instances: int = 64, acts: int = 10) -> tuple[linden.Batch, int]:
    """The batch at the end, and how many began again."""
    scene = linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml")
    batch = linden.Batch(scene, instances, observe=["q", "v", "contact:left_foot", "contact:right_foot"])
    batch.reset(seed=1, spread=0.02)
    rng = np.random.default_rng(1)
    width, servos = batch.observations.shape[1], batch.targets.shape[1]
    layers = [rng.normal(0, 0.1, shape) for shape in ((width, 64), (64, servos))]
    pose = batch.targets.copy()
    height = batch.layout["q"].offset + 2
    again = 0
    for _ in range(acts):
        batch.targets[:] = pose + act(batch.observations, layers)
        batch.step(20)
        fallen = batch.failed | (batch.observations[:, height] < 0.5)
        if fallen.any():
            again += int(fallen.sum())
            batch.reset(fallen, seed=1, spread=0.02)
    return batch, again


if __name__ == "__main__":
    begin = time.perf_counter()
    batch, again = run()
    steps = int(batch.steps.sum())
    print(f"{batch}: {steps / (time.perf_counter() - begin):,.0f} env-steps per second with the policy, {again} began again")
