"""Errors of users of the command line, besides those of `ident` and `sim`.

There is a class for each error that is caught or counted by studies; any other error is a `ScenarioError` with a
one-line message.
"""


class ScenarioError(ValueError):
    """An impossible scenario or study, or use of one."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range, the name of what does not exist, or a draw of such a value."""


class CountedError(ScenarioError):
    """A task of a study or a call of a method without a result; studies count it by `kind`, no user sees it raised.

    Attributes:
        kind: `WorkerDied` or `WorkerFailed`; of a call `MethodTimedOut`, `MethodOutOfMemory`, `MethodCrashed` or
            `MethodNotStarted`; of an answer `NoAnswer`, `NotFinite`, `WrongForm`, `WrongJoints` or `ImpossibleGain`.
    """

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind
