"""Errors of users of the command line, besides those of `ident` and `sim`.

Studies count a task or a call of a method without a result by the `kind` of its error: `WorkerDied` or `WorkerFailed`;
of a call `MethodTimedOut`, `MethodOutOfMemory`, `MethodCrashed` or `MethodNotStarted`; of an answer `NoAnswer`,
`NotFinite`, `WrongForm`, `WrongJoints` or `ImpossibleGain`.
"""

from ident.support.errors import ProjectError


class ScenarioError(ProjectError, ValueError):
    """An impossible scenario or study, or use of one, or a task of a study without a result."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range, the name of what does not exist, or a draw of such a value."""
