"""linden simulates large trees of rigid bodies so that energy and momentum stay right for as long as you run.

    import linden
    model = linden.load("models/humanoid.urdf", base="floating")
    sim = linden.Simulation(model, step=1e-3, effects={"gravity": [0, 0, -9.81], "servo": {"stiffness": 200, "damping": 20}})
    sim.run(1000)
    sim.q, sim.v, sim.energy, sim.pose("left_foot"), sim.joint("left_knee_pitch").q

    batch = linden.Batch(sim.scene, instances=4096, observe=["q", "v", "pose:pelvis"])
    batch.step(20)
    batch.observations                  # [4096, width]

Units are SI; quaternions are x y z w; vectors of six are angular first. A floating base has its position and quaternion in q, and in v its
angular, then linear velocity in its own frame. Errors are `linden.InputError` (a ValueError) and `linden.StepError` (a RuntimeError).
"""

from importlib.metadata import version as _version

from ._processor import processor  # before all that uses _core

from ._core import (
    CentreOfMass,
    Contact,
    Energy,
    Joint,
    Kinematics,
    LinkDistance,
    Model,
    Momentum,
    NearPair,
    Observed,
    Pose,
    Proximity,
    Scene,
    Status,
    StepReport,
    StepsReport,
    best_instructions,
    srdf_disabled_pairs,
)
from .batch import Batch
from .errors import InputError, InputWarning, StepError
from .scenes import Settings, load, load_scene, parse_urdf, scene, step_forces
from .simulation import Simulation
from .views import View, view

__version__ = _version("linden")

__all__ = [
    "Batch",
    "CentreOfMass",
    "Contact",
    "Energy",
    "InputError",
    "InputWarning",
    "Joint",
    "Kinematics",
    "LinkDistance",
    "Model",
    "Momentum",
    "NearPair",
    "Observed",
    "Pose",
    "Proximity",
    "Scene",
    "Settings",
    "Simulation",
    "Status",
    "StepError",
    "StepReport",
    "StepsReport",
    "View",
    "best_instructions",
    "load",
    "load_scene",
    "parse_urdf",
    "processor",
    "scene",
    "srdf_disabled_pairs",
    "step_forces",
    "view",
]
