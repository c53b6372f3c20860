"""Mountings: payloads of the motions of an experiment, by name.

`protocol = ["bare", "light", "heavy", "bare"]` names them in order of time. `bare` is the flange alone. Other names are
keys of `[plant.payloads]` and `[belief.payloads]`; `loaded` is the payload in key `payload` of both. Motions of one
name are one mounting.
"""

import re
from collections.abc import Mapping, Sequence
from typing import TypeVar

from ident.support.naming import nearest, shown
from scenarios.support.errors import UnknownName, WrongValue

Body = TypeVar("Body")

BARE, LOADED = "bare", "loaded"
PAIR = (BARE, LOADED)
"""The paper's protocol, the default."""
UNLOADED = "unloaded"
"""Name of a bare motion in files and messages."""
NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Pattern of names of mountings; they are used as file names, in which a hyphen precedes the repetition number."""
MOST_MOTIONS = 64
"""Largest number of motions of an experiment."""


def mountings(protocol: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the payloads that a protocol mounts, in the order of their first motions."""
    return tuple(dict.fromkeys(name for name in protocol if name != BARE))


def motion_names(protocol: Sequence[str]) -> tuple[str, ...]:
    """Return a name for each motion: `unloaded` or its mounting, with suffixes `-2` and so on for repetitions."""
    names: list[str] = []
    for k, carried in enumerate(protocol):
        earlier = list(protocol[:k]).count(carried)
        name = UNLOADED if carried == BARE else carried
        names.append(f"{name}-{earlier + 1}" if earlier else name)
    return tuple(names)


def grouped(protocol: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of the motions in order of time, but with motions of one payload grouped at its first one.

    Identification uses this order, and so does a command line, in which a payload follows its recordings.
    """
    first = {name: list(protocol).index(name) for name in mountings(protocol)}
    return tuple(sorted(range(len(protocol)), key=lambda k: first.get(protocol[k], k)))


def by_mounting(single: Body | None, named: Mapping[str, Body]) -> dict[str, Body]:
    """Return payloads by mounting; the one in key `payload` is `loaded`."""
    return {**({} if single is None else {LOADED: single}), **named}


def check_protocol(
    protocol: Sequence[str], plant: Mapping[str, object], belief: Mapping[str, object], path: str
) -> None:
    """Check that plant and belief have the payloads of a protocol.

    Raises:
        WrongValue: If there are no motions or too many, or a name is not valid.
        UnknownName: If a name is missing in plant or belief.
    """
    if not 0 < len(protocol) <= MOST_MOTIONS:
        raise WrongValue(
            f"{path}: experiment.protocol: {len(protocol)} motions; expected 1 to {MOST_MOTIONS}, "
            'such as ["bare", "loaded"]'
        )
    for side, names in (("plant", plant), ("belief", belief)):
        for name in names:
            if not NAME.fullmatch(name) or name in (BARE, UNLOADED):
                raise WrongValue(
                    f"{path}: {side}.payloads: {shown(name)} is no name for a payload; expected small letters, digits "
                    f"and _, not {BARE} or {UNLOADED}"
                )
    if not plant:
        raise WrongValue(f"{path}: plant: no payload; state payload, or payloads by name")
    for one, other, names, there in (("belief", "plant", belief, plant), ("plant", "belief", plant, belief)):
        for name in names:
            if name not in there:
                raise UnknownName(
                    f"{path}: {one} has a payload {name!r}, {other} has not{nearest(name, there)}; "
                    f"known: {', '.join(there) or 'none'}"
                )
    for name in protocol:
        if name != BARE and name not in plant:
            raise UnknownName(
                f"{path}: experiment.protocol: no payload {shown(name)}{nearest(name, (BARE, *plant))}; "
                f"known: {', '.join((BARE, *plant))}"
            )
