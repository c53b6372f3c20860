"""Methods from elsewhere, and our own, called alike: a problem folder in, an answer out, in a process of their own.

A text names a method. Which kind it is of, its own module here knows; the last kind takes what no other claims.
"""

from collections.abc import Callable

from scenarios.benchmark.methods import command, estimator, function
from scenarios.benchmark.methods.method import Method

METHOD_KINDS: dict[str, Callable[[str], Method | None]] = {
    "exec": command.method,
    "function": function.method,
    "estimator": estimator.method,
}
"""Each makes the method that a text names, or None if the text is of another kind."""


def method_of(text: str) -> Method:
    """The method that a text names.

    Raises:
        ScenarioError: If there is none.
    """
    found = (kind(text) for kind in METHOD_KINDS.values())
    return next(method for method in found if method is not None)
