"""Declarative experiments: scenario files, the verdict on them, studies, reports, and the command line `rx90`."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenarios.assertions import assert_scenario

__all__ = ["assert_scenario"]


def __getattr__(name: str) -> object:
    """`assert_scenario`, when it is asked for: it imports simulator and identification, over a second."""
    if name == "assert_scenario":
        from scenarios.assertions import assert_scenario

        return assert_scenario
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
