"""What is wrong is told by an exception of the right type, whose message names the argument, what was found, what was expected and the
nearest name; and nothing is changed by it."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import linden
from places import MODELS, SCENES

NAN = float("nan")


def chain() -> linden.Simulation:
    effects = {"gravity": [0, 0, -9.81], "servo": {"stiffness": 1.0}, "friction": 1e-4, "wrench": {"link1": {"force": [0, 0, 0]}}}
    return linden.Simulation("chain:3", effects=effects)


def arm() -> linden.Simulation:
    return linden.Simulation(MODELS / "arm.urdf")


def ground() -> linden.Simulation:
    return linden.Simulation(SCENES / "humanoid_drop.yaml")


def batch(**options: Any) -> linden.Batch:
    scene = linden.scene("chain:3", effects={"gravity": [0, 0, -9.81], "servo": {"stiffness": 1.0}, "friction": 1e-4})
    return linden.Batch(scene, 5, observe=["q"], **options)


def assigned(owner: Callable[[], Any], name: str, value: Any) -> Callable[[], None]:
    return lambda: setattr(owner(), name, value)


def written(rows: str, value: float) -> Callable[[], None]:
    def step() -> None:
        made = batch()
        getattr(made, rows)[3, 0] = value
        made.step()

    return step


# what is done; words that the message must have
CASES: dict[str, tuple[Callable[[], Any], tuple[str, ...]]] = {
    # loading
    "a file that is not there": (lambda: linden.load("nowhere.urdf"), ("nowhere.urdf",)),
    "a generated model of no known kind": (lambda: linden.load("chian:3"), ("chian:3", "chain")),
    "a count that is none": (lambda: linden.load("chain:x"), ("chain:x",)),
    "a base that is none": (lambda: linden.load(MODELS / "arm.urdf", base="flaoting"), ("flaoting", "floating")),
    "a density that is negative": (lambda: linden.load(MODELS / "arm.urdf", density=-1), ("density", "-1")),
    "text that is no URDF": (lambda: linden.parse_urdf("<robot"), ("urdf",)),
    "text of another kind": (lambda: linden.parse_urdf("<mujoco/>", source="my.xml"), ("my.xml", "mujoco", "robot")),
    "a scene that is not there": (lambda: linden.load_scene("nowhere.yaml"), ("nowhere.yaml",)),
    "a spread that is negative": (lambda: linden.load_scene(SCENES / "arm_servo.yaml", spread=-1.0), ("spread", "-1")),
    # settings
    "a setting that is misspelled": (lambda: linden.Simulation("chain:3", stepp=1e-3), ("stepp", "step")),  # type: ignore[call-arg]
    "an effect that is misspelled": (lambda: linden.Simulation("chain:3", effects={"gravty": [0, 0, 0]}), ("gravty", "gravity")),
    "gravity of two": (lambda: linden.Simulation("chain:3", effects={"gravity": [0, 0]}), ("effects.gravity", "list of 2", "[x, y, z]")),
    "gravity that is no number": (lambda: linden.Simulation("chain:3", effects={"gravity": [0, 0, NAN]}), ("effects.gravity", "nan")),
    "a joint that is misspelled": (
        lambda: linden.Simulation(MODELS / "arm.urdf", effects={"damping": {"joint_9": 1.0}}),
        ("effects.damping", "joint_9", "joint_"),
    ),
    "a step that is zero": (lambda: linden.Simulation("chain:3", step=0.0), ("step", "0")),
    "a step that is no number": (lambda: linden.Simulation("chain:3", step="fast"), ("step", "fast")),  # type: ignore[arg-type]
    "an order that is none": (lambda: linden.Simulation("chain:3", order=3), ("order", "3")),
    "a solver that is none": (lambda: linden.Simulation("chain:3", solver="newtn"), ("solver", "newtn", "newton")),
    "a value of a type that no scene has": (lambda: linden.Simulation("chain:3", effects={"gravity": object()}), ("gravity", "object")),
    "a key that is no text": (lambda: linden.Simulation("chain:3", effects={3: 1}), ("effects", "3")),
    "settings beside a scene": (lambda: linden.Simulation(linden.scene("chain:3"), step=1e-3), ("step", "scene")),
    "a start outside limits": (
        lambda: linden.Simulation(MODELS / "arm.urdf", effects={"limits": "urdf"}, initial={"positions": {"joint_4": 9.0}}),
        ("joint_4", "9"),
    ),
    "a batch of order 3": (lambda: linden.Batch("chain:3", 2, order=3), ("order", "3")),
    # state
    "q of another length": (assigned(chain, "q", [1, 2]), ("q", "[2]", "[3]")),
    "q of two dimensions": (assigned(chain, "q", [[1, 2, 3]]), ("q", "[1, 3]", "[3]")),
    "q of text": (assigned(chain, "q", "abc"), ("q", "str")),
    "q with NaN": (assigned(chain, "q", [0, NAN, 0]), ("nan",)),
    "v of another length": (assigned(chain, "v", np.zeros(4)), ("v", "[4]", "[3]")),
    "v with infinity": (assigned(chain, "v", [0, np.inf, 0]), ("inf",)),
    "forces of another length": (assigned(chain, "forces", np.zeros(2)), ("forces", "[2]", "[3]")),
    "forces with NaN": (assigned(chain, "forces", [0, NAN, 0]), ("nan",)),
    "targets of another length": (assigned(chain, "targets", [0.0]), ("targets", "[1]", "[3]")),
    "targets with infinity": (assigned(chain, "targets", [0, np.inf, 0]), ("inf",)),
    "gains of another length": (lambda: chain().set_gains([1.0]), ("factors", "[1]", "[3]")),
    "gains that are negative": (lambda: chain().set_gains([1.0, -1.0, 1.0]), ("-1",)),
    "friction of another length": (lambda: chain().set_friction([1.0]), ("force", "[1]", "[3]")),
    "friction that is negative": (lambda: chain().set_friction([1.0, -1.0, 1.0]), ("-1",)),
    "friction of no ground": (lambda: chain().set_ground_friction(1.0), ("ground",)),
    "friction of the ground that is negative": (lambda: ground().set_ground_friction(-1.0), ("-1",)),
    "a wrench on a link that is misspelled": (lambda: arm().set_wrench("tool_flang", [1, 0, 0]), ("tool_flang", "tool_flange")),
    "a wrench on a link without one": (lambda: arm().set_wrench("tool_flange", [1, 0, 0]), ("wrench",)),
    "a wrench of two": (lambda: arm().set_wrench("tool_flange", [1, 0]), ("force", "[2]", "[3]")),
    "a run of less than no steps": (lambda: chain().run(-1), ("steps", "-1")),
    # asking
    "a pose of a link that is misspelled": (lambda: arm().pose("tool_flang"), ("tool_flang", "tool_flange")),
    "a joint that is misspelled, asked for": (lambda: arm().joint("joint_8"), ("joint_8", "joint_")),
    "a frame that is misspelled": (lambda: arm().twist("link_7", "wrld"), ("frame", "wrld", "world")),
    "an acceleration in the world's frame": (lambda: arm().acceleration("link_7", "world"), ("world", "aligned")),
    "a point of two": (lambda: arm().kinematics().point_jacobian("link_7", [0, 0]), ("point", "[2]", "[3]")),
    "a force of another length": (lambda: arm().kinematics().solve_mass_matrix([1, 2]), ("f", "[2]", "[7]")),
    "torques of another length": (lambda: arm().kinematics().forward_dynamics([1, 2]), ("tau", "[2]", "[7]")),
    "accelerations of another length": (lambda: arm().inverse_dynamics([1, 2]), ("a", "[2]", "[7]")),
    "wrenches of another shape": (lambda: arm().kinematics().inverse_dynamics(np.zeros((7, 6))), ("outside", "[7, 6]", "[8, 6]")),
    "armature of another length": (assigned(lambda: arm().kinematics(), "armature", [1.0]), ("armature", "[1]", "[7]")),
    "gravity of four": (lambda: linden.Kinematics(linden.load("chain:3"), gravity=[0, 0, 0, 1]), ("gravity", "[4]", "[3]")),
    "a state of another length": (lambda: linden.Kinematics(linden.load("chain:3"), [0, 0]), ("q", "[2]", "[3]")),
    "a state with NaN": (lambda: linden.Kinematics(linden.load("chain:3"), [0, 0, NAN]), ("nan",)),
    "a target of a joint without servo": (lambda: arm().joint("joint_1").target, ("joint_1", "servo")),
    "step forces of another length": (
        lambda: linden.step_forces(linden.load("chain:3"), [0, 0], [0] * 3, [0] * 3, 1e-3),
        ("q0", "[2]", "[3]"),
    ),
    "step forces of no step": (lambda: linden.step_forces(linden.load("chain:3"), [0] * 3, [0] * 3, [0] * 3, 0.0), ("step",)),
    "an observation that is misspelled": (lambda: arm().observe(["pos:link_7"]), ("pos:link_7", "pose")),
    "an observation of a link that is misspelled": (lambda: arm().observe(["pose:lnk_7"]), ("lnk_7", "link_7")),
    "a row of another length": (lambda: arm().observe(["q"], out=np.zeros(3)), ("3", "7")),
    "a record of every zeroth step": (lambda: arm().record(10, ["q"], every=0), ("every", "0")),
    "a record of less than no steps": (lambda: arm().record(-10, ["q"]), ("steps", "-10")),
    # many
    "a batch of less than none": (lambda: linden.Batch("chain:3", -1), ("-1",)),
    "an observation of a batch that is misspelled": (lambda: linden.Batch("chain:3", 2, observe=["qq"]), ("qq",)),
    "instructions that are none": (lambda: batch(instructions="avx3"), ("avx3", "avx2")),
    "less than no threads": (lambda: batch(threads=-1), ("threads", "-1")),
    "numbers of 16 bits": (lambda: batch(dtype=np.float16), ("dtype", "float16", "float64", "float32")),
    "observations of 16 bits": (lambda: batch(observation_dtype=np.int32), ("observation_dtype", "int32", "float64")),
    "less than no steps": (lambda: batch().step(-1), ("-1",)),
    "targets that are infinite": (written("targets", np.inf), ("instance 3", "joint1", "inf")),
    "forces that are NaN": (written("forces", NAN), ("instance 3", "joint1", "nan")),
    "gains that are below zero": (written("gains", -2.0), ("instance 3", "joint1", "-2")),
    "friction that is below zero": (written("friction", -2.0), ("instance 3", "joint1", "-2")),
    "gravity that is NaN": (written("gravity", NAN), ("instance 3", "gravity", "nan")),
    "a number of instances that is none": (lambda: linden.Batch("chain:3", 1.5), ("instances", "1.5", "whole")),  # type: ignore[arg-type]
    "steps that are no whole number": (lambda: batch().step(1.5), ("n", "1.5", "whole")),  # type: ignore[arg-type]
    "a name that stands alone": (lambda: linden.Batch("chain:3", 2, observe="com"), ("observe", "com", "list")),
    "a name that stands alone, asked of a simulation": (lambda: chain().observe("com"), ("names", "com", "list")),
    "targets of another shape": (assigned(batch, "targets", np.zeros((3, 3))), ("targets", "(3,3)", "[5, 3]")),
    "an instance that there is not": (lambda: batch().set("gravity", [0, 0, 1], which=[9]), ("which", "9", "0 to 4")),
    "an instance that there is not, to begin again": (lambda: batch().reset([-1]), ("which", "-1", "0 to 4")),
    "a seed below zero": (lambda: batch().reset(seed=-1), ("seed", "zero or more")),
    "a start that is not finite": (lambda: batch().reset([2], q=[0, NAN, 0]), ("q", "joint2", "instance 2", "nan", "nothing was reset")),
    "a mass of zero": (lambda: batch().set("mass:link1", 0.0), ("instance 0", "link1", "0 kg", "above zero")),
    "a parameter that is misspelled": (lambda: batch().set("frictoin:joint1", 1.0), ("frictoin:joint1", "friction")),
    "a mask of another length": (lambda: batch().reset(np.zeros(4, bool)), ("which", "[4]", "[5]")),
    "instances that are no whole numbers": (lambda: batch().reset([0.5]), ("which", "float64")),
    "an instance that is not there": (lambda: batch().reset([5]), ("5",)),
    "a reset to another length": (lambda: batch().reset(q=np.zeros(4)), ("q", "4", "[5, 3]")),
    "a reset to NaN": (lambda: batch().reset([2], q=[0, NAN, 0]), ("2", "nan")),
    "a reset to rates of another shape": (lambda: batch().reset([0, 1], v=np.zeros((3, 3))), ("v", "[2, 3]")),
    "a spread without a seed": (lambda: batch().reset(spread=0.1), ("spread", "seed")),
    "a spread below zero": (lambda: batch().reset(seed=1, spread=-0.1), ("spread", "-0.1")),
    "a parameter of no kind": (lambda: batch().set("weight:link1", 1.0), ("weight:link1", "mass:LINK")),
    "a mass of a link that is misspelled": (lambda: batch().set("mass:lnk1", 1.0), ("lnk1", "link1")),
    "a mass below zero": (lambda: batch().set("mass:link1", -1.0, 2), ("2", "-1")),
    "masses of another length": (lambda: batch().set("mass:link1", [1.0, 2.0, 3.0]), ("mass:link1", "[5]")),
    "inertias of another shape": (lambda: batch().set("inertia:link1", np.ones(9)), ("inertia:link1", "[5, 10]")),
    "an inertia of no body": (lambda: batch().set("inertia:link1", np.zeros(10) - 1), ("link1", "mass")),
    "a gain of a joint that is misspelled": (lambda: batch().set("gain:jont1", 1.0), ("jont1", "joint1")),
    "a parameter of no kind, read": (lambda: batch().get("weight:link1"), ("weight:link1", "mass:LINK")),
    "an instance to describe that is not there": (lambda: batch().describe(9), ("9",)),
    "what is asked of many and misspelled": (lambda: batch().ask(["pose:lnk2"]), ("lnk2", "link2")),
    "targets that do not fit": (assigned(batch, "targets", np.zeros(4)), ("4",)),
}


@pytest.mark.parametrize("case", CASES)
def test_messages_say_what_is_wrong(case: str) -> None:
    act, words = CASES[case]
    # NumPy's own ValueError where an array is assigned to; else linden's
    with pytest.raises(ValueError) as caught:
        act()
    message = str(caught.value)
    if case != "targets that do not fit":
        assert isinstance(caught.value, linden.InputError), repr(caught.value)
    missing = [word for word in words if word.lower() not in message.lower()]
    assert not missing, f"{missing} not in: {message}"
    assert len(message) < 600 and "0x" not in message


# what nanobind or Python itself refuses: the type of an argument
@pytest.mark.parametrize(
    "act",
    [
        lambda: chain().run("ten"),  # type: ignore[arg-type]
        lambda: chain().run(1.5),  # type: ignore[arg-type]
        lambda: arm().pose(3),  # type: ignore[arg-type]
        lambda: linden.load(3),  # type: ignore[arg-type]
        lambda: linden.Simulation(3),  # type: ignore[arg-type]
        lambda: linden.Simulation(None),  # type: ignore[arg-type]
        lambda: linden.Simulation(),  # type: ignore[call-arg]
        lambda: linden.Batch("chain:3"),  # type: ignore[call-arg]
        lambda: linden.Batch("chain:3", "many"),  # type: ignore[arg-type]
        lambda: linden.Batch("chain:3", 2, dtype="float65"),
        lambda: batch().step("two"),  # type: ignore[arg-type]
        lambda: linden.Kinematics("chain:3"),  # type: ignore[arg-type]
        assigned(chain, "q", None),
    ],
)
def test_arguments_of_another_type_are_a_type_error(act: Callable[[], Any]) -> None:
    with pytest.raises(TypeError):
        act()


def test_an_error_changes_nothing() -> None:
    sim = chain()
    sim.q, sim.v, sim.targets = [0.1, 0.2, 0.3], [1, 2, 3], [0.5, 0.5, 0.5]
    q, v, p, targets = sim.q, sim.v, sim.p, sim.targets
    for name, value in (("q", [0, NAN, 0]), ("v", [0, NAN, 0]), ("targets", [0, np.inf, 0]), ("q", [1]), ("forces", [NAN, 0, 0])):
        with pytest.raises(linden.InputError):
            setattr(sim, name, value)
    for now, before in ((sim.q, q), (sim.v, v), (sim.p, p), (sim.targets, targets), (sim.forces, np.zeros(3))):
        np.testing.assert_array_equal(now, before)

    many = batch()
    many.reset(seed=1, spread=0.3)
    q, steps = many.q, many.steps
    many.gains[4, 2] = -1
    with pytest.raises(linden.InputError):
        many.step(3)
    with pytest.raises(linden.InputError):
        many.reset([0, 1], q=[[0, 0, 0], [0, NAN, 0]])
    np.testing.assert_array_equal(many.q, q)
    np.testing.assert_array_equal(many.steps, steps)
    many.gains[4, 2] = 1
    many.step(3)


def test_a_step_that_cannot_be_taken_leaves_the_state_as_it_was() -> None:
    sim = chain()
    sim.q = [0.1, 0.2, 0.3]
    sim.run(5)
    q, p, time = sim.q, sim.p, sim.time
    sim.forces = [0, 1e12, 0]
    with pytest.raises(linden.StepError) as caught:
        sim.step()
    report = caught.value.report
    assert isinstance(report, linden.StepReport) and not report.ok and report.status != linden.Status.converged
    assert len(str(caught.value)) > 20
    np.testing.assert_array_equal(sim.q, q)
    np.testing.assert_array_equal(sim.p, p)
    assert sim.time == time
    with pytest.raises(linden.StepError) as caught:
        sim.run(100)
    assert isinstance(caught.value.report, linden.StepsReport)
    assert not caught.value.report.ok and caught.value.report.last.status != linden.Status.converged
    np.testing.assert_array_equal(sim.q, q)
    sim.forces = None
    untouched = chain()
    untouched.q = [0.1, 0.2, 0.3]
    untouched.run(10)
    sim.run(5)
    np.testing.assert_array_equal(sim.q, untouched.q)


def test_errors_are_those_that_python_programs_catch() -> None:
    assert issubclass(linden.InputError, ValueError) and issubclass(linden.StepError, RuntimeError)
    assert issubclass(linden.InputWarning, UserWarning)
    error = pickle.loads(pickle.dumps(linden.InputError("what")))
    assert isinstance(error, linden.InputError) and str(error) == "what"


def test_a_report_tells_of_a_step_that_went() -> None:
    report = linden.Simulation("chain:3").step()
    assert report.ok and report.status == linden.Status.converged and report.evaluations >= 1
    assert "ok" in repr(report).lower()
    total = linden.Simulation("chain:3").run(10)
    assert total.ok and total.steps == 10 and total.evaluations >= 10


def test_what_a_file_says_in_vain_is_a_warning(tmp_path: Path) -> None:
    text = (MODELS / "arm.urdf").read_text()
    strange = text.replace("<robot ", "<robot ", 1).replace("</robot>", "<sensr/></robot>")
    file = tmp_path / "arm.urdf"
    file.write_text(strange)
    with pytest.warns(linden.InputWarning, match="sensr") as told:
        model = linden.load(file)
    assert any("sensr" in warning for warning in model.warnings)
    assert any(warning.filename == __file__ for warning in told), "told at the line of the caller"
    with pytest.warns(linden.InputWarning, match="sensr") as told:
        linden.Simulation(file)
    assert any(warning.filename == __file__ for warning in told)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        linden.load(MODELS / "arm.urdf")
        linden.Simulation("chain:3")


def test_objects_die_in_any_order() -> None:
    sim = linden.Simulation("chain:3")
    model, joint, now, cached = sim.model, sim.joint("joint1"), sim.kinematics(), sim.scene
    del sim
    assert joint.q == 0 and model.nq == 3 and now.q.shape == (3,) and cached.model.nv == 3
    del cached, model
    joint.q = 0.5
    assert joint.q == 0.5
    model = linden.Kinematics(linden.load("chain:3")).model
    assert model.nq == 3
