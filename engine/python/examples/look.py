"""Load a robot and look at it: what it is made of, how it falls, where its links are.

    python engine/python/examples/look.py [ROBOT.urdf]
"""

import sys
from pathlib import Path

import numpy as np

import linden

MODELS = Path(__file__).resolve().parents[3] / "models"


def look(file: Path) -> linden.Simulation:
    model = linden.load(file, base="floating")
    print(f"{model.name}: {len(model.bodies)} bodies, {model.degrees_of_freedom} degrees of freedom, {model.mass:.4g} kg")
    for joint, body, lower, upper in zip(model.joints[1:6], model.bodies[1:6], model.lower[6:], model.upper[6:], strict=False):
        print(f"  {joint} carries {body}, from {lower:.3g} to {upper:.3g}")

    sim = linden.Simulation(model, initial={"base": {"position": [0, 0, 2]}})
    print(sim.energy)
    sim.run(500)
    print(f"after {sim.time} s: centre of mass at {sim.centre_of_mass.position.round(4)} m, {sim.energy}")
    for link in model.links[-3:]:
        print(f"  {link}: {sim.pose(link)}, {np.linalg.norm(sim.twist(link)[3:]):.3f} m/s")
    return sim


if __name__ == "__main__":
    look(Path(sys.argv[1]) if len(sys.argv) > 1 else MODELS / "humanoid.urdf")
