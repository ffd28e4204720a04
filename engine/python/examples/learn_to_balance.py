"""A one-leg hopper learns to keep its balance, and to hop, by the cross-entropy method over a linear policy.

    python engine/python/examples/learn_to_balance.py            # a minute or two; learning curve in learn_to_balance.png
    python engine/python/examples/learn_to_balance.py --quick    # seconds: few generations of few candidates

The hopper moves in a plane: trunk, thigh, shank and foot, 9 kg, with servos at hip, knee and ankle. 50 times a second the policy reads
its height, its angles and how fast they change, and sets the servos' targets; 10 steps of 2 ms follow without Python. Standing still falls
over within a second. Each generation draws candidates about the mean of the last one's best, tries them all at once, each from the same few
starts, and keeps the best eighth. The same seed learns the same to the bit on any number of threads.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import linden
import linden.gym

Array = NDArray[np.float64]

HOPPER = """
<robot name="hopper">
  <link name="world"/>
  <joint name="x" type="prismatic">
    <parent link="world"/> <child link="rail_x"/> <axis xyz="1 0 0"/> <limit lower="-1000" upper="1000" effort="0" velocity="100"/>
  </joint>
  <link name="rail_x"/>
  <joint name="z" type="prismatic">
    <parent link="rail_x"/> <child link="rail_z"/> <axis xyz="0 0 1"/> <limit lower="-1000" upper="1000" effort="0" velocity="100"/>
  </joint>
  <link name="rail_z"/>
  <joint name="pitch" type="continuous"> <parent link="rail_z"/> <child link="trunk"/> <axis xyz="0 1 0"/> </joint>
  <link name="trunk">
    <inertial> <origin xyz="0 0 0.2"/> <mass value="4"/> <inertia ixx="0.08" iyy="0.08" izz="0.02" ixy="0" ixz="0" iyz="0"/> </inertial>
  </link>
  <joint name="hip" type="revolute">
    <parent link="trunk"/> <child link="thigh"/> <axis xyz="0 1 0"/> <limit lower="-1.2" upper="0.6" effort="100" velocity="20"/>
  </joint>
  <link name="thigh">
    <inertial> <origin xyz="0 0 -0.2"/> <mass value="2.5"/> <inertia ixx="0.04" iyy="0.04" izz="0.01" ixy="0" ixz="0" iyz="0"/> </inertial>
  </link>
  <joint name="knee" type="revolute">
    <parent link="thigh"/> <child link="shank"/> <origin xyz="0 0 -0.4"/> <axis xyz="0 1 0"/>
    <limit lower="0" upper="1.8" effort="100" velocity="20"/>
  </joint>
  <link name="shank">
    <inertial> <origin xyz="0 0 -0.2"/> <mass value="1.5"/> <inertia ixx="0.02" iyy="0.02" izz="0.004" ixy="0" ixz="0" iyz="0"/> </inertial>
  </link>
  <joint name="ankle" type="revolute">
    <parent link="shank"/> <child link="foot"/> <origin xyz="0 0 -0.4"/> <axis xyz="0 1 0"/>
    <limit lower="-0.8" upper="0.8" effort="50" velocity="20"/>
  </joint>
  <link name="foot">
    <inertial> <origin xyz="0.04 0 -0.03"/> <mass value="1"/>
      <inertia ixx="0.002" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/> </inertial>
    <collision> <origin xyz="-0.06 0 -0.04"/> <geometry> <sphere radius="0.03"/> </geometry> </collision>
    <collision> <origin xyz="0.14 0 -0.04"/> <geometry> <sphere radius="0.03"/> </geometry> </collision>
  </link>
  <joint name="head" type="fixed"> <parent link="trunk"/> <child link="head"/> <origin xyz="0 0 0.4"/> </joint> <link name="head"/>
  <joint name="heel" type="fixed"> <parent link="foot"/> <child link="heel"/> <origin xyz="-0.06 0 -0.04"/> </joint> <link name="heel"/>
  <joint name="toe" type="fixed"> <parent link="foot"/> <child link="toe"/> <origin xyz="0.14 0 -0.04"/> </joint> <link name="toe"/>
</robot>
"""

# Hip, knee and ankle a little bent, the sole on the ground and the centre of mass above the foot.
START = {"z": 0.845, "hip": -0.35, "knee": 0.6, "ankle": -0.25}
ANGLES = ("pitch", "hip", "knee", "ankle")
SEEN = ["q:z", *(f"q:{joint}" for joint in ANGLES), "v:x", "v:z", *(f"v:{joint}" for joint in ANGLES), "time"]
STEP = 0.02  # [s] of the environment
EPISODE = 300  # steps of it: 6 s, in which standing is worth 3
STARTS = 2  # that each candidate is tried from
BEAT = 2.2  # hops a second that the policy's clock suggests


def hopper() -> linden.Scene:
    return linden.scene(
        linden.parse_urdf(HOPPER, source="hopper"),
        step=2e-3,
        initial={"positions": START},
        effects={
            "gravity": [0, 0, -9.81],
            "armature": {"hip": 0.01, "knee": 0.01, "ankle": 0.01},
            "limits": {joint: "urdf" for joint in ("hip", "knee", "ankle")},
            "servo": {"stiffness": 150, "damping": 6, "joints": ["hip", "knee", "ankle"]},
            "ground": {"stiffness": 2e4, "damping": 200, "friction": 0.9},
        },
    )


def reward(seen: linden.gym.Seen, actions: NDArray[np.floating]) -> Array:
    """One for each metre forward, at up to 1 m/s, and a half for each second upright."""
    forward: Array = np.clip(seen["v:x"][:, 0], -1, 1)
    return STEP * (forward + 0.5)


def fallen(seen: linden.gym.Seen, actions: NDArray[np.floating]) -> NDArray[np.bool_]:
    down: NDArray[np.bool_] = (seen["q:z"][:, 0] < 0.55) | (np.abs(seen["q:pitch"][:, 0]) > 0.7)
    return down


def environment(candidates: int, threads: int) -> linden.gym.VectorEnv:
    return linden.gym.VectorEnv(
        hopper(), candidates * STARTS, observe=SEEN, reward=reward, terminated=fallen, frame_skip=10, max_episode_steps=EPISODE,
        spread=0.04, threads=threads, observation_dtype=np.float64,
    )


def features(observations: Array) -> Array:
    """What the policy reads [N, 14]: numbers about 1 in size, the phase of its clock, and 1."""
    usual = np.array([START["z"], 0, START["hip"], START["knee"], START["ankle"], 0, 0, 0, 0, 0, 0])
    sizes = np.array([0.1, 0.2, 0.4, 0.4, 0.4, 1, 1, 2, 5, 5, 5])
    phase = 2 * np.pi * BEAT * observations[:, -1:]
    return np.hstack([(observations[:, :-1] - usual) / sizes, np.sin(phase), np.cos(phase), np.ones((len(observations), 1))])


def acted(policies: Array, observations: Array) -> Array:
    """Actions [N, actions] of policies [N, features, actions]."""
    # sums of NumPy's own, not a matrix product, whose last digits may depend on threads
    actions: Array = (features(observations)[:, :, np.newaxis] * policies).sum(1)
    return actions


def returns(env: linden.gym.VectorEnv, policies: Array, seed: int) -> Array:
    """Sums of rewards of one episode [candidates, starts] of each policy [candidates, features, actions] from each start."""
    every = np.repeat(policies, STARTS, axis=0)
    observations, _ = env.reset(seed=[STARTS * seed + k for k in range(STARTS)] * len(policies))
    total, running = np.zeros(len(every)), np.ones(len(every), np.bool_)
    for _ in range(EPISODE):
        observations, rewards, terminated, truncated, _ = env.step(acted(every, observations))
        total += rewards * running
        running &= ~(terminated | truncated)
        if not running.any():
            break
    return total.reshape(len(policies), STARTS)


def learn(generations: int, candidates: int, threads: int, seed: int, tell: bool = True) -> tuple[Array, Array]:
    """The policy that is learned [features, actions], and the curve [generations, 3]: mean, best, and that of the mean policy."""
    env = environment(candidates, threads)
    random = np.random.default_rng(seed)
    shape = (features(np.zeros((1, len(SEEN)))).shape[1], env.action_space.shape[1])  # type: ignore[index]
    mean, width = np.zeros(shape), np.full(shape, 0.4)
    kept, curve = max(4, candidates // 8), np.empty((generations, 3))
    began = time.perf_counter()
    for generation in range(generations):
        policies = mean + width * random.standard_normal((candidates, *shape))
        policies[0] = mean
        reached = returns(env, policies, 1000 * seed + generation).mean(1)
        best = policies[np.argsort(-reached, kind="stable")[:kept]]
        mean = best.mean(0)
        # some width stays, so that the search does not stop too early
        width = best.std(0) + 0.1 * max(0.0, 1 - generation / 30)
        curve[generation] = reached.mean(), reached.max(), reached[0]
        if tell:
            mean_of, best_of, middle = curve[generation]
            print(f"generation {generation + 1:3}   all {mean_of:6.2f}   best {best_of:6.2f}   their mean {middle:6.2f}"
                  f"   {time.perf_counter() - began:5.1f} s", flush=True)
    return mean, curve


def motion(policy: Array, seed: int) -> Array:
    """The outline of one hopper, from head to heel, toe and ankle, at the start of every step of an episode [frames, points, x and z]."""
    env = environment(1, threads=1)
    points = [f"position:{link}" for link in ("head", "trunk", "shank", "foot", "heel", "toe")]
    observations, _ = env.reset(seed=[seed] * STARTS)
    frames = []
    for _ in range(EPISODE):
        frames.append(env.batch.ask(points)[0].reshape(-1, 3)[[0, 1, 2, 3, 4, 5, 3]][:, [0, 2]])
        observations, _, terminated, truncated, _ = env.step(acted(policy[np.newaxis], observations))
        if terminated[0] or truncated[0]:
            break
    return np.array(frames)


def draw(curve: Array, policy: Array, file: Path) -> None:
    """The learning curve above; below the hopper as the first policy and as the last moves it, four times a second."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=[3, 2])
    generations = np.arange(1, len(curve) + 1)
    for column, name in enumerate(("all candidates", "best candidate", "mean of the best")):
        above.plot(generations, curve[:, column], label=name)
    above.axhline(EPISODE * STEP / 2, color="grey", linestyle=":", label="standing for 6 s")
    above.set(xlabel="generation", ylabel="return", xlim=(1, len(curve)))
    above.legend()
    for policy_shown, colour in ((np.zeros_like(policy), "lightgrey"), (policy, "C2")):
        for frame in motion(policy_shown, seed=1)[:: round(0.25 / STEP)]:
            below.plot(frame[:, 0], frame[:, 1], color=colour, marker="o", markersize=3)
    below.axhline(0, color="black", linewidth=0.8)
    below.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
    figure.savefig(file, dpi=70, pil_kwargs={"optimize": True} if file.suffix == ".png" else None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few candidates and generations")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0, help="0: all there are")
    parser.add_argument("--picture", type=Path, default=Path("learn_to_balance.png"))
    parser.add_argument("--save", type=Path, help="policy and learning curve, as .npz")
    arguments = parser.parse_args()
    generations, candidates = (10, 40) if arguments.quick else (40, 96)
    policy, curve = learn(generations, candidates, arguments.threads, arguments.seed)
    print(f"return of the mean policy: {curve[0, 2]:.2f} at first, {curve[-1, 2]:.2f} at last")
    if arguments.save:
        np.savez(arguments.save, policy=policy, curve=curve)
    try:
        draw(curve, policy, arguments.picture)
        print(f"learning curve in {arguments.picture}")
    except ImportError:
        print("no picture: matplotlib is not there; pip install matplotlib")


if __name__ == "__main__":
    main()
