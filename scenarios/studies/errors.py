"""What keeps a study from being begun or continued."""

from scenarios.errors import ScenarioError


class StudyError(ScenarioError):
    """A study folder or executor that cannot be used; its message is one line for the user."""
