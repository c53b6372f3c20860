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
    """A call of a method without an answer; it is counted, never raised to the user."""


class MethodTimedOut(MethodError):
    """The call exceeded its time limit."""


class MethodOutOfMemory(MethodError):
    """The call exceeded its memory limit."""


class MethodCrashed(MethodError):
    """The call ended with an error or by a signal."""


class MethodNotStarted(MethodError):
    """The method could not be started."""


class NoAnswer(MethodError):
    """The output is not a JSON object, or too long."""


class NotFinite(MethodError):
    """A number of the answer is not finite."""


class WrongForm(MethodError):
    """A key of the answer is missing, or a value has the wrong type."""


class WrongJoints(MethodError):
    """The answer does not have one gain for each joint, in order."""


class ImpossibleGain(MethodError):
    """A gain of zero, a negative standard deviation, or a contradictory entry."""
