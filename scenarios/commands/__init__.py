"""The commands of `rx90`: one file each, with its arguments (`add_arguments`) and its function (`main`)."""

from importlib import import_module
from types import ModuleType

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
    "validate": {
        "verify": "test gains with a known payload, cross-validate, or compare",
    },
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
NEEDED = {
    **dict.fromkeys(("excite", "payload", "paper", "sensitivity", "monte-carlo", "compare"), "study"),
    "report": "pages",
    "view": "film",
}
"""The package extra that a command needs, if any."""
COMMANDS = {name: summary for group in GROUPS.values() for name, summary in group.items()}
"""All of them; `monte-carlo` is the module `monte_carlo` here."""


def command(name: str) -> ModuleType:
    """Import the module of a command in `COMMANDS`: `add_arguments` declares its arguments, `main` runs it."""
    return import_module(f"{__name__}.{name.replace('-', '_')}")
