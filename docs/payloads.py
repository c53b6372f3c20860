"""Writes payloads.md: what a designed weight shows beside the scenario's own payload, on every built-in robot."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from opening import write_page

HOME = Path(__file__).parent
OUT = Path("out") / "payloads"
SCENARIOS = ("nominal", "mass-only", "ur10e", "tx40", "panda", "stanford")
HEAD = """# Accuracy with designed payloads

Written by `make payloads`, which runs `rx90 payload` on the built-in scenarios; no number is typed by hand. Predicted
standard deviation of the gain of the worst joint [%], all joints wanted, along the scenario's own motion: with its
**own** payload and with the best designed one that may be mounted (**weight**); **as made** includes the tolerances of
the drawing and the scale. It is of steel, no heavier than the robot's rated load, and within the limits of torque and
distance along that motion. If the motion was searched for the scenario's own payload, that payload may be the better
one, and the command says so.

| Scenario | Own [kg] | Own [%] | Weight [%] | As made [%] | Shape [mm] | Mass [kg] | Rated load [kg] | Joints shown |
|---|---|---|---|---|---|---|---|---|
"""


def worst(joints: Sequence[Mapping[str, float]]) -> float:
    """Largest deviation from noise [%]."""
    return 100.0 * max(joint["std"] for joint in joints)


def worst_as_made(joints: Sequence[Mapping[str, float]]) -> float:
    """Largest deviation from noise and from what is known of the payload [%]."""
    return 100.0 * max(float(np.hypot(joint["std"], joint["payload_std"])) for joint in joints)


def shown(joints: Sequence[Mapping[str, float]]) -> int:
    """Joints whose gains identification would not refuse."""
    return sum(bool(joint["shown"]) for joint in joints)


def row(found: Mapping[str, Any]) -> str:
    """A line of the table from what `rx90 payload --json` prints."""
    before, after, best = found["before"], found["after"], found["candidates"][0]
    own, new = worst(before["joints"]), worst(after["joints"])
    numbers = [f"**{each:.2f}**" if each == min(own, new) else f"{each:.2f}" for each in (own, new)]
    size = " x ".join(f"{value:g}" for value in best["dimensions_mm"].values())
    rated = "not stated" if found["rated_load"] is None else f"{found['rated_load']:g}"
    joints = f"{shown(before['joints'])} before, {shown(after['joints'])} after, of {len(after['joints'])}"
    return (
        f"| `{found['scenario']}` | {before['payload']['mass']:.2f} | {numbers[0]} | {numbers[1]} | "
        f"{worst_as_made(after['joints']):.2f} | {best['shape']} {size} | {after['payload']['mass']:.2f} | {rated} | "
        f"{joints} |"
    )


def kept(name: str) -> Mapping[str, Any]:
    """What the command says of a scenario, from an earlier run if there is one.

    Raises:
        SystemExit: If the command fails.
    """
    path = OUT / f"{name}.json"
    if not path.is_file():
        words = [sys.executable, "-m", "scenarios", "payload", name, "--json", "--quiet"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):  # 1: a joint stays unseen
            raise SystemExit(f"{' '.join(words[2:])}: {done.stderr}")
        OUT.mkdir(parents=True, exist_ok=True)
        path.write_text(done.stdout, encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def main() -> None:
    """Design what is not designed yet, one scenario after another, and write the page with each."""
    rows = []
    for name in SCENARIOS:
        rows.append(row(kept(name)))
        print(rows[-1], flush=True)
        write_page(HOME / "payloads.md", HEAD + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
