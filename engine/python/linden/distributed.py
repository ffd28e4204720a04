"""Rollouts over several processes and machines with mpi4py: each rank has a share of the instances, by number.

    from mpi4py import MPI
    from linden import distributed

    own = distributed.share(4096, MPI.COMM_WORLD)                                 # range(1024, 2048) at rank 1 of 4
    batch = linden.Batch(scene, len(own), threads=distributed.threads(MPI.COMM_WORLD))
    batch.reset(seed=1 + own.start, spread=0.1)                                   # instance i by seed 1 + i, whoever has it

What instance i does is the same to the bit for any number of ranks and threads, on machines of the same instructions
(linden.Batch(..., instructions="avx2") where they differ); `linden rollout` deals instances out alike.
"""

from __future__ import annotations

import os
from typing import Any, Protocol

from .errors import InputError

__all__ = ["share", "threads"]


class Communicator(Protocol):
    """What is asked of one, such as mpi4py's MPI.COMM_WORLD."""

    def Get_rank(self) -> int: ...
    def Get_size(self) -> int: ...


def share(instances: int, communicator: Communicator) -> range:
    """Numbers of the instances of this rank, of so many of all ranks: neighbours, and no rank has two more than another.

    Raises InputError where there are fewer instances than ranks.
    """
    rank, ranks = communicator.Get_rank(), communicator.Get_size()
    if instances < ranks:
        raise InputError(f"instances: {instances} for {ranks} ranks; expected one for each, or more; start fewer ranks")
    each, more = divmod(instances, ranks)
    first = rank * each + min(rank, more)
    return range(first, first + each + (rank < more))


def threads(communicator: Any) -> int:
    """Threads that this rank may use so that all ranks of its machine together use the cores that they have, each once.

    communicator: of mpi4py; all of its ranks call this.
    """
    from mpi4py import MPI

    own = os.sched_getaffinity(0)
    machine = communicator.Split_type(MPI.COMM_TYPE_SHARED)
    all_cores = set().union(*machine.allgather(own))
    ranks = machine.Get_size()
    machine.Free()
    return int(max(1, min(len(own), len(all_cores) // ranks)))
