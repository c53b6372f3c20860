"""What Pinocchio is given of a robot model: links and joints, every number checked, nothing else."""

from dataclasses import dataclass

ESCAPED = str.maketrans({each: f"&#{ord(each)};" for each in '&<>"\n\r\t'})
"""What stands for characters that an attribute cannot hold; `xml.sax.saxutils` has it, and imports a web client."""
EARTH = (0.0, 0.0, -9.81)
"""Gravity of a model that states none [m/s^2]."""


@dataclass(frozen=True, slots=True)
class MinimalModel:
    """A robot model reduced to its kinematics.

    Attributes:
        kind: The format of `text`, "mjcf" or "urdf".
        text: A complete document of that format.
        gravity: Gravity in the world frame [m/s^2].
    """

    kind: str
    text: str
    gravity: tuple[float, float, float] = EARTH


def tag(name: str, attributes: dict[str, str], *inside: str) -> str:
    """An XML element as text."""
    start = " ".join((name, *(f'{key}="{value.translate(ESCAPED)}"' for key, value in attributes.items())))
    return f"<{start}>{''.join(inside)}</{name}>" if inside else f"<{start}/>"
