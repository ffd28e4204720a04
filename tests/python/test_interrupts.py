"""Ctrl-C ends what takes long, between two steps; other threads run meanwhile, and may not touch what is in use."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import linden


@pytest.fixture(autouse=True)
def ctrl_c() -> Iterator[None]:
    """As in a terminal: what a shell starts in the background ignores the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(call: Callable[[], object], after: float = 0.2) -> float:
    """Seconds of work of all threads between the signal and its end, whatever else the machine does."""
    sent: list[float] = []

    def press() -> None:
        time.sleep(after)
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)

    presser = threading.Thread(target=press)
    presser.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
        return time.process_time() - sent[0]
    finally:
        try:
            presser.join()
        except KeyboardInterrupt:
            pass  # of a call that had ended before


@pytest.mark.parametrize("name", ["chain:3", "chain:400"])
def test_a_run_ends_between_two_steps(name: str) -> None:
    sim, other = linden.Simulation(name), linden.Simulation(name)
    assert interrupted(lambda: sim.run(10**9)) < 1
    assert 0 < sim.steps < 10**9
    other.run(sim.steps)
    np.testing.assert_array_equal(sim.q, other.q)
    np.testing.assert_array_equal(sim.p, other.p)
    sim.run(3)
    other.run(3)
    np.testing.assert_array_equal(sim.q, other.q)


def test_a_record_ends_between_two_steps() -> None:
    sim, other = linden.Simulation("chain:3"), linden.Simulation("chain:3")
    assert interrupted(lambda: sim.record(10**6, ["q"])) < 1
    other.run(sim.steps)
    np.testing.assert_array_equal(sim.q, other.q)


def test_a_batch_ends_between_two_steps() -> None:
    batch, other = (linden.Batch("chain:20", 50, observe=["q"]) for _ in range(2))
    assert interrupted(lambda: batch.step(10**9)) < batch.threads
    (steps,) = set(batch.steps)
    assert 0 < steps < 10**9
    other.step(int(steps))
    np.testing.assert_array_equal(batch.q, other.q)
    batch.step(2)
    other.step(2)
    np.testing.assert_array_equal(batch.observations, other.observations)


def during(call: Callable[[], object]) -> threading.Thread:
    """A thread that is in the call."""
    thread = threading.Thread(target=call)
    thread.start()
    time.sleep(0.1)
    assert thread.is_alive(), "the call was to last longer"
    return thread


def test_other_threads_run_meanwhile() -> None:
    sim, batch = linden.Simulation("chain:50"), linden.Batch("chain:50", 100, threads=1)
    for call in (lambda: sim.run(20_000), lambda: batch.step(1_000)):
        turns = 0
        thread = threading.Thread(target=call)
        begin = time.monotonic()
        thread.start()
        while thread.is_alive():
            turns += 1
            time.sleep(0.001)
        # with the interpreter's lock held there were one turn, or one for each of the parts of 0.05 s: 20 a second
        assert turns > 40 * (time.monotonic() - begin)


def test_what_is_in_use_is_refused() -> None:
    sim, batch = linden.Simulation("chain:50"), linden.Batch("chain:50", 100, observe=["q"])
    thread = during(lambda: sim.run(30_000))
    uses: list[Callable[[], object]] = [
        lambda: sim.q, lambda: sim.step(), lambda: sim.run(1), lambda: sim.energy, lambda: sim.pose(sim.scene.model.links[0]),
        lambda: sim.joint("joint1"), lambda: setattr(sim, "q", np.zeros(50)), lambda: sim.observe(["q"]), lambda: sim.kinematics(),
    ]  # fmt: skip
    refused = 0
    for use in uses:
        with pytest.raises(RuntimeError, match="another thread"):
            use()
        refused += 1
    assert thread.is_alive() and refused == len(uses)
    thread.join()
    assert sim.steps == 30_000

    thread = during(lambda: batch.step(2_000))
    for use in (lambda: batch.q, lambda: batch.step(), lambda: batch.reset(), lambda: batch.status, lambda: batch.set("mass:link1", 1.0)):
        with pytest.raises(RuntimeError, match="another thread"):
            use()
    assert thread.is_alive()
    thread.join()
    assert (batch.steps == 2_000).all()


def test_threads_with_objects_of_their_own_get_the_same_bits() -> None:
    model = linden.load("chain:20")
    alone = linden.Simulation(model)
    alone.run(2_000)
    sims = [linden.Simulation(model) for _ in range(4)]
    threads = [threading.Thread(target=sim.run, args=(2_000,)) for sim in sims]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for sim in sims:
        np.testing.assert_array_equal(sim.q, alone.q)
