"""Methods in Python: `package.module:function`, which takes a `GivenProblem` and returns the gains.

It returns a sequence with one mapping per joint, as the gains of `rx90 identify --json`: `estimate` and `std`, or a
`reason`. `joint` and `identifiable` may be omitted.
"""

import importlib
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.metadata import packages_distributions, version
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import cast

from ident.support.naming import shown
from scenarios.benchmark.methods.method import Method, digests
from scenarios.results.problem_folder import GivenProblem
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import PACKAGES

FORM = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):([A-Za-z_]\w*)")
Gains = Sequence[Mapping[str, object]]


def method(text: str) -> Method | None:
    """Return the method of a text, None if the text does not name a function.

    Raises:
        ScenarioError: If the module cannot be imported or lacks the function.
    """
    if ":" not in text:
        return None
    module = _loaded(text).__module__
    spec = find_spec(module)
    origin = spec.origin if spec is not None else None
    return Method(text, digests=(*digests([Path(origin)] if origin else []), *packages(sys.modules[module])))


def answered(text: str, problem: GivenProblem) -> dict[str, object]:
    """Call the function; return the answer as a JSON object, not validated."""
    gains = _loaded(text)(problem)
    rows = [
        {
            "joint": joint,
            "std": None,
            "estimate": None,
            "reason": None,
            **gain,
            "identifiable": gain.get("identifiable", gain.get("estimate") is not None),
        }
        for joint, gain in enumerate(gains, 1)
    ]
    return {"gains": rows}


def packages(module: ModuleType) -> tuple[tuple[str, str], ...]:
    """Return name and version of each package that a module imports, without those that every study records."""
    held = vars(module).values()
    origins = {
        value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None) for value in held
    }
    known = _distributions()
    tops = {origin.partition(".")[0] for origin in origins if isinstance(origin, str)}
    named = {name for top in tops for name in known.get(top, ())} - set(PACKAGES)
    return tuple((name, version(name)) for name in sorted(named))


@cache
def _distributions() -> Mapping[str, Sequence[str]]:
    """Return the distributions of a package, from the list of installed files."""
    return packages_distributions()


def _loaded(text: str) -> Callable[[GivenProblem], Gains]:
    """Import the function; the working folder is last in the search path, so that it hides no installed module."""
    found = FORM.fullmatch(text)
    if found is None:
        raise ScenarioError(f"method {shown(text)}: expected package.module:function, or exec:COMMAND")
    module, name = found.groups()
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        function = getattr(importlib.import_module(module), name, None)
    except ImportError as error:
        raise ScenarioError(f"method {shown(text)}: {error}") from error
    if not callable(function):
        raise ScenarioError(f"method {shown(text)}: module {module} has no function {name}")
    return cast(Callable[[GivenProblem], Gains], function)
