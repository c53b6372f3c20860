"""What a user of the command line can get wrong, besides what `ident` and `sim` refuse."""


class ScenarioError(ValueError):
    """A scenario or motion file that cannot be used; its message is one line for the user."""


class StudyError(ScenarioError):
    """A study folder or executor that cannot be used; its message is one line for the user."""
