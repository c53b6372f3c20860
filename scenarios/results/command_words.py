"""Words of commands that do it again: recordings with their payloads, coupled motors, options that are not defaults."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from ident.estimation.gain_options import GainOptions
from ident.observation.observation import ObserveOptions
from scenarios.results.problem_folder import MotionTable


def motion_words(folder: Path, motions: Sequence[MotionTable]) -> list[str]:
    """Recordings in their order, those of a payload followed by its description.

    Args:
        folder: That holds them.
        motions: As identification is given them.
    """
    words: list[str] = []
    for payload, carrying in groupby(motions, key=lambda motion: motion.payload):
        words += ["--unloaded" if payload is None else "--loaded", *(str(folder / each.recording) for each in carrying)]
        words += [] if payload is None else ["--payload", str(folder / payload)]
    return words


def coupling_words(couplings: Sequence[tuple[int, int]]) -> list[str]:
    """Options that say which motors turn with two joints, from 1."""
    return [word for first, second in couplings for word in ("--coupling", str(first), str(second))]


def option_words(observe: Mapping[str, object], gains: Mapping[str, object], own: Mapping[str, object]) -> list[str]:
    """Options other than their defaults.

    Args:
        observe: Of `ObserveOptions`, by name; what is left out has its default.
        gains: Of `GainOptions` likewise.
        own: Of the method; what is None has its default.
    """
    words: list[str] = []
    for stated, defaults in ((observe, asdict(ObserveOptions())), (gains, asdict(GainOptions()))):
        for name, usual in defaults.items():
            value = stated.get(name, usual)
            flag, text = f"--{name.replace('_', '-')}", str(value)
            words += [] if value == usual else [f"{flag}={text}"] if text.startswith("-") else [flag, text]
    for name, value in own.items():
        words += [] if value is None else ["--option", f"{name}={value}"]
    return words
