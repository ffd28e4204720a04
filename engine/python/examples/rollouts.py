"""Rollouts as a table: forty humanoids fall, each from another pose; one row an instance and a time. It becomes a DataFrame of pandas where
that is installed, an HDF5 file where h5py is, and a CSV file in any case.

    python engine/python/examples/rollouts.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"
SEEN = ["time", "com", "energy", "pose:head"]


def rollouts(instances: int = 40, frames: int = 20, steps: int = 10) -> tuple[list[str], NDArray[np.float64]]:
    """Names of columns, and rows [frames, instances, columns]."""
    scene = linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml")
    batch = linden.Batch(scene, instances, observe=SEEN)
    batch.reset(seed=1, spread=0.05)
    columns = [row for entry in batch.layout.values() for row in entry.rows]
    rows = np.empty((frames, instances, len(columns)))
    for frame in rows:
        frame[...] = batch.observations
        batch.step(steps)
    return columns, rows


def write(folder: Path) -> list[Path]:
    columns, rows = rollouts()
    instances = np.tile(np.arange(rows.shape[1]), rows.shape[0])
    table = np.column_stack([instances, rows.reshape(-1, rows.shape[2])])
    files = [folder / "rollouts.csv"]
    np.savetxt(files[0], table, delimiter=",", header=",".join(["instance", *columns]), comments="")
    try:
        import pandas
    except ImportError:
        print("no pandas: no DataFrame")
    else:
        frame = pandas.DataFrame(table, columns=["instance", *columns]).astype({"instance": int})
        print(frame.groupby("time")[columns[3]].describe().iloc[::5])
    try:
        import h5py
    except ImportError:
        print("no h5py: no HDF5 file")
    else:
        files.append(folder / "rollouts.h5")
        with h5py.File(files[1], "w") as file:
            data = file.create_dataset("rows", data=rows, compression="gzip")
            data.attrs["columns"] = columns
    return files


if __name__ == "__main__":
    for written in write(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())):
        print(f"{written}: {written.stat().st_size:,} bytes")
