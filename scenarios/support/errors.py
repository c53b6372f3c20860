"""Errors of users of the command line, besides those of `ident` and `sim`.

There is a class for each error that is caught or counted by studies; any other error is a `ScenarioError` with a
one-line message.
"""


class ScenarioError(ValueError):
    """An impossible scenario or use of one."""


class UnknownName(ScenarioError):
    """The name of a scenario, motion, payload or method that does not exist."""


class UnreadableFile(ScenarioError):
    """A scenario or motion file that is missing, too large, or not valid TOML."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range."""


class WrongDraw(ScenarioError):
    """A random value that cannot be drawn."""


class StudyError(ScenarioError):
    """A study that cannot be run."""


class ForeignProblem(ScenarioError):
    """A folder that is not a valid problem folder."""


class MethodError(ScenarioError):
    """A call of a method without an answer; it is counted, never raised to the user.

    Attributes:
        kind: `MethodTimedOut`, `MethodOutOfMemory`, `MethodCrashed` or `MethodNotStarted`; of an answer `NoAnswer`,
            `NotFinite`, `WrongForm`, `WrongJoints` or `ImpossibleGain`.
    """

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind
