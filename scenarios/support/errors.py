"""Errors of users of the command line, besides those of `ident` and `sim`.

There is a class for each error that is caught or counted by studies; any other error is a `ScenarioError` with a
one-line message.
"""


class ScenarioError(ValueError):
    """An impossible scenario or use of one."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range, the name of what does not exist, or a draw of such a value."""


class StudyError(ScenarioError):
    """A study that cannot be run."""


class MethodError(ScenarioError):
    """A call of a method without an answer; it is counted, never raised to the user.

    Attributes:
        kind: `MethodTimedOut`, `MethodOutOfMemory`, `MethodCrashed` or `MethodNotStarted`; of an answer `NoAnswer`,
            `NotFinite`, `WrongForm`, `WrongJoints` or `ImpossibleGain`.
    """

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind
