"""Humanoids on their way to the ground, with all that a batch takes in by rows."""

from __future__ import annotations

import numpy as np

import linden
from places import MODELS

N = 19  # no multiple of what is computed together
SEEN = ["q", "v", "energy", "pose:left_foot", "contact:left_foot"]


def dropped(seed: int) -> linden.Scene:
    return linden.scene(
        linden.load(MODELS / "humanoid.urdf", "floating"),
        initial={"base": {"position": [0.0, 0.0, 0.92]}, "positions": {"left_knee_pitch": 0.2}, "seed": seed, "spread": 0.0},
        start="as given",
        effects={
            "gravity": [0, 0, -9.81],
            "armature": 0.01,
            "damping": "urdf",
            "friction": 0.4,
            "servo": {"stiffness": 800, "damping": 40},
            "ground": {"stiffness": 1e5, "damping": 500, "friction": 0.8},
        },
        randomize={"masses": 0.2, "friction": [0.4, 1.0]},
    )


def started(scene: linden.Scene, instances: int = N, **options: object) -> linden.Batch:
    batch = linden.Batch(scene, instances, observe=SEEN, **options)  # type: ignore[arg-type]
    batch.reset(seed=3, spread=0.05)
    return batch


def acted(batch: linden.Batch, rows: slice = slice(None)) -> linden.Batch:
    """Everything that can be written is, by instance."""
    rng = np.random.default_rng(1)
    scene = batch.scene
    batch.targets[...] = np.asarray(scene.q)[7:].mean() + rng.uniform(-0.2, 0.2, (N, len(scene.servos)))[rows]
    batch.forces[...] = rng.uniform(-1, 1, (N, batch.model.nv))[rows]
    batch.gains[...] = rng.uniform(0.8, 1.2, (N, len(scene.servos)))[rows]
    batch.friction[...] = rng.uniform(0.1, 0.5, (N, len(scene.rubbing_joints)))[rows]
    batch.ground_friction[...] = rng.uniform(0.4, 1, (N, 1))[rows]
    batch.gravity[...] = np.array([0, 0, -9.81]) + rng.uniform(-1, 1, (N, 3))[rows]
    return batch
