"""Arrays in and out: which are live, which are of the moment, who shares them without a copy."""

from __future__ import annotations

import numpy as np
import pytest

import linden
from humanoids import SEEN, N, started


def test_observations_are_one_array_that_lives(drop: linden.Scene) -> None:
    batch = started(drop)
    seen = batch.observations
    address = seen.ctypes.data
    first = seen.copy()
    batch.step()
    assert batch.observations is seen and seen.ctypes.data == address and (seen != first).any()
    layout = batch.layout
    assert list(layout) == SEEN
    assert seen.shape == (N, sum(entry.width for entry in layout.values()))
    np.testing.assert_array_equal(seen[:, layout["q"].slice], batch.q)
    np.testing.assert_array_equal(seen[:, layout["v"].slice], batch.v)
    np.testing.assert_array_equal(seen[:, layout["energy"].slice], batch.energy)
    np.testing.assert_array_equal(seen[:, layout["pose:left_foot"].slice], batch.ask(["pose:left_foot"]))
    assert layout["pose:left_foot"].rows and len(layout["q"].rows) == batch.model.nq
    assert layout["energy"].units


def test_single_precision_is_near_and_half_as_large(drop: linden.Scene) -> None:
    double, single = started(drop), started(drop, dtype=np.float32)
    assert single.dtype == single.observations.dtype == single.q.dtype == single.targets.dtype == np.float32
    assert double.observations.dtype == np.float64
    assert single.nbytes < 0.7 * double.nbytes
    for batch in (double, single):
        batch.reset(q=batch.q + np.eye(batch.model.nq)[2])  # clear of the ground, whose contacts magnify any difference
        batch.step(10)
    np.testing.assert_allclose(single.q, double.q, rtol=0, atol=1e-4)


def test_observations_may_be_single_where_the_state_is_double(drop: linden.Scene) -> None:
    batch, double = started(drop, observation_dtype="float32"), started(drop)
    batch.step(3)
    double.step(3)
    assert batch.observations.dtype == np.float32
    np.testing.assert_array_equal(batch.observations, double.observations.astype(np.float32))


def test_blocks_are_the_state_where_it_lies(drop: linden.Scene) -> None:
    batch = started(drop)
    blocks = batch.q_blocks
    assert blocks.shape[1:] == (batch.lanes, batch.model.nq)
    assert not blocks.flags.owndata and not blocks.flags.writeable
    batch.step(5)
    assert blocks.ctypes.data == batch.q_blocks.ctypes.data
    np.testing.assert_array_equal(blocks.reshape(-1, batch.model.nq)[:N], batch.q)
    assert batch.p_blocks.shape[1:] == (batch.lanes, batch.model.nv)
    del batch
    assert np.isfinite(blocks[0, 0]).all(), "the view keeps the batch alive"


def test_arrays_of_the_moment_stay_as_they_were(drop: linden.Scene) -> None:
    batch, sim = started(drop), linden.Simulation("chain:3")
    for array in (batch.q, batch.v, batch.energy, batch.status, sim.q, sim.v, sim.p, sim.mass_matrix()):
        assert not array.flags.writeable
    q, before = batch.q, batch.q.copy()
    batch.step(3)
    np.testing.assert_array_equal(q, before)
    with pytest.raises(ValueError, match="read-only"):
        sim.q[0] = 1.0


def test_observations_go_by_dlpack_without_a_copy(drop: linden.Scene) -> None:
    batch = started(drop)
    shared = np.from_dlpack(batch.observations)
    assert np.shares_memory(shared, batch.observations)
    batch.step()
    np.testing.assert_array_equal(shared, batch.observations)


def test_torch_writes_what_a_batch_reads(drop: linden.Scene) -> None:
    torch = pytest.importorskip("torch")
    batch, other = started(drop), started(drop)
    torch.from_dlpack(batch.targets)[:] = 0.1
    other.targets[:] = 0.1
    seen = torch.from_dlpack(batch.observations)
    batch.step(5)
    other.step(5)
    np.testing.assert_array_equal(seen.numpy(), other.observations)


def test_jax_reads_what_a_batch_writes(drop: linden.Scene) -> None:
    jax = pytest.importorskip("jax")
    batch = started(drop, dtype=np.float32)
    batch.step(5)
    np.testing.assert_array_equal(np.asarray(jax.dlpack.from_dlpack(batch.observations)), batch.observations)


def test_values_come_from_whatever_numpy_takes() -> None:
    sim = linden.Simulation("chain:3")
    rows: list[object] = [[0.1, 0.2, 0.3], (0.1, 0.2, 0.3), np.array([0.1, 0.2, 0.3], np.float32), np.array([9, 0.1, 9, 0.2, 9, 0.3])[1::2]]
    for row in rows:
        sim.q = row  # type: ignore[assignment]
        np.testing.assert_allclose(sim.q, [0.1, 0.2, 0.3], rtol=1e-7)
    sim.q = np.array([1, 2, 3])
    np.testing.assert_array_equal(sim.q, [1.0, 2.0, 3.0])


def test_a_batch_says_what_it_is(drop: linden.Scene) -> None:
    batch = linden.Batch(drop, 6, threads=2)
    assert len(batch) == batch.instances == 6
    assert batch.model.name in repr(batch)
    assert batch.instructions == linden.best_instructions()
    assert batch.scene is drop
    assert batch.observations.shape == (6, 0)
    empty = batch.observations
    batch.step(2)
    assert batch.observations is empty
