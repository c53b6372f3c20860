"""The commands of `rx90`, related ones in a module: `X_arguments` declares the arguments of X, `X_command` runs X."""

import argparse
from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple

from scenarios.command_line.process import Status

GROUPS: dict[str, dict[str, str]] = {
    "try it": {
        "list": "list the built-in scenarios",
        "run": "simulate a scenario, identify its gains, test them",
        "view": "show the motions of a scenario, live or as a picture",
        "paper": "repeat the paper's experiment: tables 2 to 4, figure 3",
    },
    "your robot": {
        "new-robot": "create a robot and scenario from a model file",
        "excite": "search for the motion with the smallest gain uncertainty",
        "payload": "design a payload that identifies every gain",
    },
    "record": {
        "record": "what to command, mount and log: instructions, motion for the controller",
        "convert": "convert a log: CSV, UR, ROS 2, Parquet, NumPy",
        "check": "detect faults of recordings or of the model",
    },
    "identify": {"identify": "identify the gains of a robot from recordings"},
    "validate": {"verify": "test gains with a known payload, or compare two sets"},
    "use": {
        "payload-of": "estimate an unknown payload from currents and gains",
        "torque": "estimate joint torques from currents and gains",
        "patch": "write identified values into a copy of a URDF or MJCF",
    },
    "study": {
        "predict": "first-order error budget, without simulation",
        "sensitivity": "error budget by simulation: effect of each error source",
        "monte-carlo": "repeat a scenario many times: errors, coverage, pass rates",
        "compare": "compare methods on scenarios, your own included",
    },
    "report": {"report": "write a saved result as one HTML page"},
    "schemas": {"schema": "JSON Schemas of files and of --json output"},
}
"""Commands in the order of use, each with a one-line summary."""
CELL = "--unloaded cell/unloaded.parquet --loaded cell/loaded.parquet --payload cell/payload.toml"
FOREIGN = "log.csv --columns 't=t[ms]' 'q=q{1..6}[deg]' 'v=i{1..6}[mA]' --signal current"
LATER = CELL.replace("cell", "later")
EXAMPLES = (
    "rx90 list", "rx90 list --json",
    "rx90 run nominal --save cell", "rx90 run nominal --seed 1 --save later --gains-out later.toml",
    "rx90 view nominal", "rx90 view nominal --render nominal.png --at 5",
    "rx90 paper", "rx90 paper --seed 3 --out paper",
    "rx90 new-robot arm.urdf --out arm", "rx90 new-robot arm.urdf --flange flange --payload 4.2 --out heavy",
    "rx90 excite nominal --out motion.toml", "rx90 excite arm/scenario.toml --protocol holds --out holds.toml",
    "rx90 payload nominal", "rx90 payload arm/scenario.toml --density 2700 --out aluminium.toml",
    "rx90 record nominal --out plan", "rx90 record arm/scenario.toml --rate 500 --out arm-plan",
    "rx90 convert cell/loaded.parquet --out loaded.csv", f"rx90 convert {FOREIGN} --out log.parquet",
    f"rx90 check rx90 {CELL.removeprefix('--unloaded ')}", "rx90 check rx90 cell/unloaded.parquet --all",
    f"rx90 identify --model rx90 {CELL}",
    f"rx90 identify --model rx90 {CELL} --compare-with 1,1,1,1,1,1 --gains-out gains.toml",
    f"rx90 verify --model rx90 --gains gains.toml {LATER}", "rx90 verify gains.toml later.toml",
    "rx90 payload-of later/loaded.parquet --model rx90 --gains gains.toml --unloaded later/unloaded.parquet",
    "rx90 payload-of tool.csv --model arm.xml --gains gains.toml --unloaded bare.csv --json",
    "rx90 torque later/loaded.parquet --gains gains.toml --out torque.parquet",
    f"rx90 torque {FOREIGN} --gains gains.toml --out torques.parquet",
    "rx90 patch arm.xml --gains gains.toml --nominal sheet.toml --out patched.xml",
    "rx90 patch arm.xml --gains gains.toml --arm bare.json --links --out whole.xml",
    "rx90 predict nominal", "rx90 predict nominal --method ls-2011",
    "rx90 sensitivity nominal --out budget", "rx90 sensitivity nominal --repeats 4 --samples 8 --jobs 2 --out quick",
    "rx90 monte-carlo nominal -n 8 --out trials", "rx90 monte-carlo arm/scenario.toml -n 300 --jobs 4 --out arm-trials",
    "rx90 compare nominal --method nls --method ls-2011 -n 4 --out methods",
    "rx90 compare nominal field --method 'exec: ./mine' -n 20 --time-limit 20 --out mine",
    "rx90 report cell", "rx90 report trials --out trials.html",
    "rx90 schema", "rx90 schema scenario",
)  # fmt: skip
"""Two commands of each kind, in the order of use; those on `rx90` use the folders of `run`."""
FIRST = [next(line for line in EXAMPLES if line.startswith(f"rx90 {name} ")) for name in ("run", "check", "identify")]
"""The commands that one needs first."""
COMMANDS = {name: summary for group in GROUPS.values() for name, summary in group.items()}
MODULES = {
    "catalog": ("list", "view", "report", "schema"),
    "design": ("new-robot", "excite", "payload"),
    "recordings": ("record", "convert", "check"),
    "identification": ("run", "paper", "identify"),
    "validation": ("verify", "payload-of", "torque", "patch"),
    "studies": ("predict", "sensitivity", "monte-carlo", "compare"),
}
"""Modules here, each with its commands; another command is in a module of its own name."""
NEEDED = {
    **dict.fromkeys(("excite", "payload", "paper", "sensitivity", "monte-carlo", "compare"), "study"),
    "report": "pages",
    "view": "film",
}
"""The package extra that a command needs, if any."""


class Command(NamedTuple):
    """A command: what declares its arguments, and what runs it with the parsed ones."""

    add_arguments: Callable[[argparse.ArgumentParser], None]
    main: Callable[[argparse.Namespace], Status]


def command(name: str) -> Command:
    """Import a command in `COMMANDS`."""
    prefix = name.replace("-", "_")
    module = next((module for module, names in MODULES.items() if name in names), prefix)
    found = import_module(f"{__name__}.{module}")
    return Command(getattr(found, f"{prefix}_arguments"), getattr(found, f"{prefix}_command"))
