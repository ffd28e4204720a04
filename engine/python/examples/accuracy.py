"""What accuracy costs: how far the energy of a swinging chain strays over ten seconds, by step and order, and how long that takes.

    python engine/python/examples/accuracy.py
"""

import time

import numpy as np

import linden


def band(order: int, step: float, seconds: float = 10.0) -> tuple[float, float]:
    """Largest less smallest energy, relative to the largest kinetic energy; and the time that it took [s]."""
    sim = linden.Simulation("chain:5", step=step, order=order, tolerance=1e-12, initial={"positions": {"joint1": 0.5}})
    begin = time.perf_counter()
    seen = sim.record(round(seconds / step), ["energy"], every=max(1, round(0.01 / step)))["energy"]
    taken = time.perf_counter() - begin
    total = seen.sum(axis=1)
    return float(np.ptp(total) / seen[:, 0].max()), taken


if __name__ == "__main__":
    print("order  step [ms]  energy band  time [s]")
    for order in (2, 4, 6):
        for step in (4e-3, 2e-3, 1e-3):
            width, taken = band(order, step)
            print(f"{order:5d} {1e3 * step:10.1f} {width:12.1e} {taken:9.3f}")
