"""Errors of the identification: one base class, one class per cause that a caller can treat differently."""

from collections.abc import Generator
from contextlib import contextmanager


class ProjectError(Exception):
    """Base of the errors that this project raises on purpose; the message is one line for the user.

    Attributes:
        reason: The reason; in the message, the place precedes it, if given.
        joint: The joint, from 0; None if it is not of one joint.
        value: The refused number, None if there is none.
        bounds: Smallest and largest number that is allowed, infinite without a limit; None without a number.
        kind: The cause, as studies count it; the name of the class if it is not stated.
    """

    def __init__(
        self,
        reason: str,
        place: str = "",
        *,
        joint: int | None = None,
        value: float | None = None,
        bounds: tuple[float, float] | None = None,
        kind: str = "",
    ) -> None:
        """State the reason, its place, as a recording, and the numbers in it."""
        super().__init__(f"{place}: {reason}" if place else reason)
        self.reason, self.joint, self.value, self.bounds = reason, joint, value, bounds
        self.kind = kind or type(self).__name__


@contextmanager
def placed(place: str) -> Generator[None]:
    """Begin the messages of errors with their place, as a file, unless they do: `place: ` or a path within it."""
    try:
        yield
    except ProjectError as error:
        if not str(error).startswith((f"{place}: ", f"{place}/")):
            error.args = (f"{place}: {error}",)
        raise


class IdentificationError(ProjectError, ValueError):
    """Base of every error this package raises on purpose."""


class RecordingError(IdentificationError):
    """A recording, its file or its description that cannot be used."""


class RobotModelError(IdentificationError):
    """A robot model that is unreadable, is not a fixed-base serial arm, or has a link that no body can be."""


class PayloadError(IdentificationError):
    """A payload description that is incomplete, mistyped or physically impossible."""


class GainsError(IdentificationError):
    """Drive gains that are impossible, of another arm, or missing."""


class OptionError(IdentificationError):
    """An option of the identification that does not exist or has an invalid value."""


class NotIdentifiable(IdentificationError):
    """Data that do not determine what is asked: too few rows, no excitation, or no convergence."""

    @classmethod
    def too_few_rows(cls, rows: int, unknowns: int, joint: int | None = None) -> "NotIdentifiable":
        """State the numbers, and the joint; rows near reversals of a joint are left out."""
        where = "" if joint is None else f"joint {joint + 1}: "
        message = (
            f"{where}{rows} rows cannot give {unknowns} unknowns; record a longer motion with fewer reversals, and "
            "positions that are neither coarse nor repeated"
        )
        return cls(message, joint=joint, value=rows, bounds=(unknowns + 1, float("inf")))


class Contradiction(IdentificationError):
    """Data that contradict the model or the payload: a sign, a zero, a column or the model is wrong."""
