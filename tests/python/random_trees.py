"""Random robots as the text of URDF files, for readers of URDF other than linden too."""

from __future__ import annotations

import numpy as np


def random_tree(seed: int, links: int = 14, mimics: int = 2) -> str:
    """A tree of hinges, sliders and fixed joints about axes of any direction, some of them mimics of others."""
    rng = np.random.default_rng(seed)
    parts = [f'<robot name="tree_{seed}">', _link("link_0", rng)]
    movers: list[str] = []
    followers = 0
    for k in range(1, links):
        parent = int(rng.integers(max(0, k - 4), k))
        kind = str(rng.choice(["revolute", "continuous", "prismatic", "fixed"], p=[0.4, 0.2, 0.2, 0.2]))
        parts.append(_link(f"link_{k}", rng))
        mimic = ""
        if kind in ("revolute", "prismatic"):
            if followers < mimics and len(movers) > 1:
                leader = str(rng.choice(movers))
                mimic = f'<mimic joint="{leader}" multiplier="{rng.uniform(-2, 2):.17g}" offset="{rng.uniform(-0.5, 0.5):.17g}"/>'
                followers += 1
            else:
                movers.append(f"joint_{k}")
        parts.append(
            f'<joint name="joint_{k}" type="{kind}"><parent link="link_{parent}"/><child link="link_{k}"/>'
            f'<origin xyz="{_numbers(rng.uniform(-0.4, 0.4, 3))}" rpy="{_numbers(rng.uniform(-3, 3, 3))}"/>'
            f'<axis xyz="{_numbers(_direction(rng))}"/><limit lower="-10" upper="10" effort="100" velocity="10"/>{mimic}</joint>'
        )
    return "\n".join([*parts, "</robot>"])


def _link(name: str, rng: np.random.Generator) -> str:
    mass = rng.uniform(0.2, 3)
    # of a box of this mass: sides a, b, c
    a, b, c = rng.uniform(0.05, 0.5, 3)
    xx, yy, zz = mass / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    return (
        f'<link name="{name}"><inertial><origin xyz="{_numbers(rng.uniform(-0.2, 0.2, 3))}" rpy="{_numbers(rng.uniform(-3, 3, 3))}"/>'
        f'<mass value="{mass:.17g}"/><inertia ixx="{xx:.17g}" ixy="0" ixz="0" iyy="{yy:.17g}" iyz="0" izz="{zz:.17g}"/></inertial></link>'
    )


def _direction(rng: np.random.Generator) -> np.ndarray:
    if rng.random() < 0.4:
        return np.eye(3)[rng.integers(3)]
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in values)
