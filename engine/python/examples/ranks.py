"""Rollouts by several processes: each rank has its share of the instances and writes its own file. Needs mpi4py and an MPI.

    mpirun -n 2 python engine/python/examples/ranks.py [FOLDER]

The files of any number of ranks, one behind the other, are the same to the bit.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from mpi4py import MPI

import linden
from linden import distributed

MODELS = Path(__file__).resolve().parents[3] / "models"
INSTANCES, FRAMES, STEPS, SEED = 40, 5, 10, 1

if __name__ == "__main__":
    ranks = MPI.COMM_WORLD
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ranks.bcast(tempfile.mkdtemp()))
    own = distributed.share(INSTANCES, ranks)
    scene = linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml")
    batch = linden.Batch(scene, len(own), observe=["com", "q"], threads=distributed.threads(ranks))
    batch.reset(seed=SEED + own.start, spread=0.05)
    frames = np.empty((FRAMES, *batch.observations.shape))
    for frame in frames:
        frame[...] = batch.observations
        batch.step(STEPS)
    np.save(folder / f"instances-{own.start:06}-{own.stop - 1:06}.npy", frames)
    failed = ranks.reduce(int(batch.failed.sum()))
    if ranks.Get_rank() == 0:
        print(f"{folder}: {INSTANCES} instances by {ranks.Get_size()} ranks, {failed} failed")
