"""Texts of a UR-like arm's model files, whole and spoilt."""

from collections.abc import Sequence

LINKS = (
    ("shoulder_pan", "0 0 0.163", "0 0 0", "0 0 1"),
    ("shoulder_lift", "0 0.138 0", "0 90 0", "0 1 0"),
    ("elbow", "0 -0.131 0.613", "0 0 0", "0 1 0"),
    ("wrist_1", "0 0 0.571", "0 90 0", "0 1 0"),
    ("wrist_2", "0 0.127 0", "0 0 0", "0 0 1"),
    ("wrist_3", "0 0 0.119", "0 0 0", "0 1 0"),
)
"""Joint, place [m], roll-pitch-yaw or MJCF euler angles [deg], axis; base to flange."""
RADIANS = {"0 0 0": "0 0 0", "0 90 0": "0 1.5707963267948966 0"}
INERTIAL = '<inertial pos="0 0 0.1" mass="2.5" diaginertia="0.02 0.03 0.04"/>'


def mjcf(
    *,
    head: str = '<compiler angle="degree" autolimits="true"/>',
    base: str = "",
    world: str = "",
    tail: str = "",
    links: Sequence[tuple[str, str, str, str]] = LINKS,
    swap: tuple[str, str] = ("", ""),
) -> str:
    """An MJCF file.

    Args:
        head: Sections before the worldbody.
        base: Attributes of the base body.
        world: Elements of the worldbody before the arm.
        tail: Sections after the worldbody.
        links: The arm.
        swap: A text and what stands in its place, once.
    """
    bodies = "".join(
        f'\n<body name="{name}_link" pos="{pos}" euler="{euler}">{INERTIAL}'
        f'<joint name="{name}_joint" axis="{axis}" range="-170 175"/>'
        for name, pos, euler, axis in links
    )
    text = (
        f'<mujoco model="ur">\n{head}\n<worldbody>{world}<body name="base" {base}>{INERTIAL}{bodies}'
        f"{'</body>' * len(links)}</body></worldbody>\n{tail}</mujoco>\n"
    )
    return _swapped(text, swap)


def urdf(*, more: str = "", swap: tuple[str, str] = ("", "")) -> str:
    """A URDF file.

    Args:
        more: Elements before the end.
        swap: A text and what stands in its place, once.
    """
    links, above = '<link name="base"/>', "base"
    for name, pos, rpy, axis in LINKS:
        links += (
            f'\n<link name="{name}_link"/><joint name="{name}_joint" type="revolute"><parent link="{above}"/>'
            f'<child link="{name}_link"/><origin xyz="{pos}" rpy="{RADIANS[rpy]}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.97" upper="3.05" effort="150" velocity="3.1"/></joint>'
        )
        above = f"{name}_link"
    return _swapped(f'<robot name="ur">\n{links}\n{more}</robot>\n', swap)


def _swapped(text: str, swap: tuple[str, str]) -> str:
    assert swap[0] in text, f"{swap[0]!r} is not there to be replaced"
    return text.replace(swap[0], swap[1], 1) if swap[0] else text
