"""Declarative experiments: scenario files, the verdict on them, studies, reports, and the command line `rx90`.

What a user needs is exported here and read when it is first used: simulator and identification take over a second.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenarios.assertions import assert_scenario
    from scenarios.errors import ScenarioError
    from scenarios.files.schema import Scenario, load_scenario
    from scenarios.judge import GainVerdict, Verdict
    from scenarios.run import Run, run_scenario

__all__ = [
    "GainVerdict",
    "Run",
    "Scenario",
    "ScenarioError",
    "Verdict",
    "assert_scenario",
    "load_scenario",
    "run_scenario",
]

_HOMES = {
    "GainVerdict": "judge",
    "Run": "run",
    "Scenario": "files.schema",
    "ScenarioError": "errors",
    "Verdict": "judge",
    "assert_scenario": "assertions",
    "load_scenario": "files.schema",
    "run_scenario": "run",
}


def __getattr__(name: str) -> object:
    """Read the module of an exported name when it is first asked for."""
    if name in _HOMES:
        value = getattr(import_module(f"scenarios.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
