"""Shares of instances, and rollouts by ranks of mpi4py, which have the bits of one process."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import linden
from linden import distributed
from places import MODELS, ROOT


@dataclass
class Place:
    rank: int
    ranks: int

    def Get_rank(self) -> int:
        return self.rank

    def Get_size(self) -> int:
        return self.ranks


@pytest.mark.parametrize("instances, ranks", [(1, 1), (7, 3), (64, 64), (1001, 7)])
def test_every_instance_belongs_to_one_rank(instances: int, ranks: int) -> None:
    shares = [distributed.share(instances, Place(rank, ranks)) for rank in range(ranks)]
    assert [i for share in shares for i in share] == list(range(instances))
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_more_ranks_than_instances_are_refused() -> None:
    with pytest.raises(linden.InputError, match="3 for 4 ranks; expected one for each"):
        distributed.share(3, Place(0, 4))


@pytest.mark.parametrize("ranks", [1, 3])
def test_ranks_have_the_bits_of_one_process(ranks: int, tmp_path: Path) -> None:
    pytest.importorskip("mpi4py")
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        pytest.skip("there is no mpirun")
    environment = os.environ | {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
    }
    example = ROOT / "engine" / "python" / "examples" / "ranks.py"
    done = subprocess.run([mpirun, "-n", str(ranks), sys.executable, example, tmp_path], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{tmp_path}: 40 instances by {ranks} ranks, 0 failed\n"
    files = sorted(tmp_path.glob("*.npy"))
    assert len(files) == ranks
    found = np.concatenate([np.load(file) for file in files], axis=1)

    batch = linden.Batch(linden.load_scene(MODELS / "scenes" / "humanoid_drop.yaml"), 40, observe=["com", "q"], threads=1)
    batch.reset(seed=1, spread=0.05)
    for frame in found:
        assert frame.tobytes() == batch.observations.tobytes()
        batch.step(10)
