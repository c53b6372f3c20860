"""External and built-in methods with one interface: from a problem folder to an answer, in a separate process.

A text names a method. The module of each kind recognises its texts; the last kind accepts all others.
"""

from collections.abc import Callable

from scenarios.benchmark.methods import command, estimator, function
from scenarios.benchmark.methods.method import Method

METHOD_KINDS: dict[str, Callable[[str], Method | None]] = {
    "exec": command.method,
    "function": function.method,
    "estimator": estimator.method,
}
"""Functions that return the method of a text, or None for a text of another kind."""


def method_of(text: str) -> Method:
    """Return the method of a text.

    Raises:
        ScenarioError: If there is none.
    """
    found = (kind(text) for kind in METHOD_KINDS.values())
    return next(method for method in found if method is not None)
