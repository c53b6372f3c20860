"""Writes holds.md: what holds and slow sweeps cost in accuracy against motions, on four robots; `make holds`."""

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from opening import write_page

from scenarios.experiments.files.loading import load_scenario

HOME = Path(__file__).parent
FOLDER = HOME.parent / "out" / "holds"
ROBOTS = ("nominal", "ur10e", "tx40", "panda")
PROTOCOLS = {"motions": 300.0, "holds": 30.0}
"""Rate of the log of each [Hz]."""
WANTED = 3.0
"""Error that is wanted [%]."""
LEFT_OUT = ("payload mass", "payload centre")
"""What `holds` draws that depends on its payload: the same share of the error in either protocol."""
HEAD = """# Holds and motions compared

Written by `make holds`, which runs `rx90 monte-carlo` with {trials} seeds on every robot; no number in the table is
typed by hand. Drives, encoders of 1.5 mrad and errors are those of the built-in scenario `holds` but for the
payload's, which is known in full. **motions**: the robot's built-in motion of 20 s, logged at 300 Hz. **holds**: 72 s
of `rx90 excite --protocol holds --evaluations 1000`, logged at 30 Hz. Root mean square of the gain's error
[%] over the seeds that gave it; `-` if every seed refused it.

"""
TAIL = """
Verify the gains with a second payload (`rx90 verify`) before you enter them in a driver.
"""


def words(table: Mapping[str, object], before: str = "") -> Iterator[str]:
    """A table as lines of TOML with dotted keys."""
    for key, value in table.items():
        name = before + (key if key.isidentifier() else json.dumps(key))
        if isinstance(value, Mapping):
            yield from words(value, f"{name}.")
        else:
            yield f"{name} = {json.dumps(value)}"


def scenario(robot: str, protocol: str) -> Path:
    """The scenario of one row, with the motion that it needs."""
    path, motion = FOLDER / f"{robot}-{protocol}.toml", FOLDER / f"{robot}-motion.toml"
    holds = tomllib.loads((HOME.parent / "scenarios" / "catalog" / "holds.toml").read_text())
    experiment, n = holds["experiment"], len(load_scenario(robot).table.tolerance.gain)
    experiment["sensors"]["log_rate_hz"] = PROTOCOLS[protocol]
    if protocol == "holds":
        experiment["motion"] = motion.name
        if not motion.is_file():
            rx90("excite", robot, "--protocol", "holds", "--evaluations", "1000", "--out", str(motion))
    else:
        del experiment["motion"]
    random = {name: table for name, table in holds["random"].items() if name not in LEFT_OUT}
    zeros = random["zeros of joints"]["parameters"]
    zeros["scale"] = [zeros["scale"][0]] * n
    table = {
        "extends": robot,
        "description": f"{robot} by {protocol}",
        "experiment": experiment,
        "identification": holds["identification"],
        "random": random,
    }
    path.write_text("\n".join(words(table)) + "\n")
    return path


def rx90(*arguments: str) -> None:
    """Run a command; a study whose tolerances are missed is a study."""
    done = subprocess.run([sys.executable, "-m", "scenarios", *arguments], check=False)
    if done.returncode > 1:
        sys.exit(done.returncode)


def row(robot: str, protocol: str, trials: int, most: int) -> str:
    """A row of the table."""
    study = FOLDER / f"{robot}-{protocol}"
    rx90("monte-carlo", str(scenario(robot, protocol)), "-n", str(trials), "--out", str(study))
    rows = pd.read_parquet(study / "trials")
    given = rows[rows["identifiable"].astype(bool)]
    rms = 100.0 * np.sqrt(given.groupby("joint")["rel_error"].apply(lambda x: np.mean(x**2)))
    cells = [f"{rms[j]:.2f}" if j in rms else "-" for j in range(1, most + 1)]
    inside, count = int((given["z"].abs() <= 2.0).sum()), len(given)
    beyond = int((rms > WANTED).sum())
    return f"| `{robot}` | {protocol} | {' | '.join(cells)} | {inside} of {count} | {beyond} |"


def main(trials: int) -> None:
    """Run what is missing, write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    joints = range(1, 8)
    table = ["| robot | protocol | " + " | ".join(f"joint {j}" for j in joints) + " | within 2 sigma | beyond 3 % |"]
    table.append("|" + "---|" * 11)
    for robot in ROBOTS:
        table += [row(robot, protocol, trials, 7) for protocol in PROTOCOLS]
    write_page(HOME / "holds.md", HEAD.format(trials=trials) + "\n".join(table) + "\n" + TAIL)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
