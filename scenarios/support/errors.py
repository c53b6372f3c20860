"""What a user of the command line can get wrong, besides what `ident` and `sim` refuse.

A class stands here where somebody catches it, or where studies count it by its name; any other cause is a
`ScenarioError`, and its message, one line for the user, says which.
"""


class ScenarioError(ValueError):
    """A scenario, or what it is used for, that cannot be."""


class UnknownName(ScenarioError):
    """The name of a scenario, motion, payload or method that does not exist."""


class UnreadableFile(ScenarioError):
    """A scenario or motion file that is missing, too large, or no TOML that can be meant."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range."""


class WrongDraw(ScenarioError):
    """A random change that cannot be made."""


class StudyError(ScenarioError):
    """A study that cannot be carried out."""


class ForeignProblem(ScenarioError):
    """A folder that is no problem, or says what cannot be."""


class MethodError(ScenarioError):
    """A call of a method that gave no answer: counted, never raised to the user."""


class MethodTimedOut(MethodError):
    """It took longer than it may."""


class MethodOutOfMemory(MethodError):
    """It wanted more memory than it may have."""


class MethodCrashed(MethodError):
    """It ended with an error or by a signal."""


class MethodNotStarted(MethodError):
    """It could not be started."""


class NoAnswer(MethodError):
    """What it said is no JSON object, or longer than any answer."""


class NotFinite(MethodError):
    """A number of its answer is not finite."""


class WrongForm(MethodError):
    """Its answer lacks a key, or a value is of another type."""


class WrongJoints(MethodError):
    """Its answer has not one gain for each joint, in their order."""


class ImpossibleGain(MethodError):
    """A gain of zero, a negative deviation, a gain that is refused and stated, or neither."""
