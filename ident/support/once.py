"""Results that are computed once for an object, and kept as long as it exists."""

from collections.abc import Callable
from functools import update_wrapper
from typing import Generic, TypeVar, TypeVarTuple
from weakref import WeakKeyDictionary

Of = TypeVar("Of")
More = TypeVarTuple("More")
Result = TypeVar("Result")


class once_per_object(Generic[Of, *More, Result]):
    """Call a function once for each object, its first argument, and each set of further arguments.

    Unlike a cache of a fixed size it suffices for any number of objects, and keeps none of them alive. The object must
    be immutable and compared by identity, further arguments are hashable; a result must not refer to the object, else
    neither is ever freed. Errors are not kept.
    """

    def __init__(self, function: Callable[[Of, *More], Result]) -> None:
        """Decorate a function of a module."""
        self._function = function
        self._known = WeakKeyDictionary[Of, dict[tuple[*More], Result]]()
        update_wrapper(self, function)

    def __call__(self, of: Of, /, *more: *More) -> Result:
        """Return the result for an object and further arguments."""
        results = self._known.setdefault(of, {})
        if more not in results:
            results[more] = self._function(of, *more)
        return results[more]
