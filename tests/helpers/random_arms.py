"""Serial arms that nobody designed: five to eight joints, axes tilted at random, some sliding, as URDF."""

from pathlib import Path

import numpy as np

LENGTH, MASS = 0.32, 11.0
"""Of the first link [m], [kg]; those after it are shorter and lighter."""
SHRINKS, LIGHTENS = 0.85, 0.7
SLIDING = 0.15
"""Share of sliding joints, none of them next to another."""


def random_arm(seed: int) -> str:
    """The URDF of an arm."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 9))
    text, above, slid = '<link name="base"/>', "base", True  # the first joint turns
    for k in range(n):
        kind = "prismatic" if not slid and rng.random() < SLIDING else "revolute"
        slid = kind == "prismatic"
        axis = _direction(rng)
        xyz = LENGTH * SHRINKS**k * (_direction(rng) + np.array([0.0, 0.0, 2.0])) / 2.4
        low, high, speed = (-0.15, 0.2, 0.6) if slid else (-2.6, 2.4, 2.2)
        text += (
            f'<joint name="joint{k + 1}" type="{kind}"><parent link="{above}"/><child link="link{k + 1}"/>'
            f'<origin xyz="{_words(xyz)}" rpy="{_words(rng.uniform(-0.5, 0.5, 3))}"/><axis xyz="{_words(axis)}"/>'
            f'<limit lower="{low}" upper="{high}" effort="0" velocity="{speed}"/></joint>'
            + _link(f"link{k + 1}", MASS * LIGHTENS**k, LENGTH * SHRINKS**k, rng)
        )
        above = f"link{k + 1}"
    return f'<robot name="arm{seed}">{text}</robot>'


def write_random_arm(folder: Path, seed: int) -> Path:
    """The arm as a file."""
    path = folder / f"arm{seed}.urdf"
    path.write_text(random_arm(seed))
    return path


def _link(name: str, mass: float, length: float, rng: np.random.Generator) -> str:
    """A link whose moments are those of a rod about thrice as long as thick, its axes turned."""
    long, across = mass * length**2 / 10.0, mass * length**2 / 40.0
    center = 0.4 * length * _direction(rng)
    return (
        f'<link name="{name}"><inertial><origin xyz="{_words(center)}" rpy="{_words(rng.uniform(-1.0, 1.0, 3))}"/>'
        f'<mass value="{mass:.5g}"/><inertia ixx="{long:.5g}" iyy="{0.9 * long:.5g}" izz="{across:.5g}" '
        f'ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{x:.6g}" for x in numbers)
