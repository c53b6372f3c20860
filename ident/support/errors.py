"""Errors of the identification: one base class, one class per cause."""


class IdentificationError(ValueError):
    """Base of every error this package raises on purpose; its message is one line for the user."""


class RecordingError(IdentificationError):
    """A recording that cannot be used.

    Attributes:
        reason: The reason; in the message, the recording's name precedes it, if given.
    """

    def __init__(self, reason: str, recording: str = "") -> None:
        """State the reason and the recording."""
        super().__init__(f"{recording}: {reason}" if recording else reason)
        self.reason = reason


class RobotModelError(IdentificationError):
    """A robot model that is unreadable or is not a fixed-base serial arm."""


class PayloadError(IdentificationError):
    """A payload description that is incomplete, mistyped or physically impossible."""


class NotIdentifiable(IdentificationError):
    """Data from which no drive gain is identifiable."""


class NegativeMass(IdentificationError):
    """A significantly negative estimate of a mass."""


class OptionError(IdentificationError):
    """An option of the identification that does not exist or has an invalid value."""


class TooFewRows(IdentificationError):
    """A linear system with too few equations for its unknowns."""

    @classmethod
    def of(cls, rows: int, unknowns: int, where: str = "") -> "TooFewRows":
        """State the numbers, and where it is, such as `joint 2`; rows near reversals of a joint are left out."""
        return cls(
            f"{f'{where}: ' if where else ''}{rows} rows cannot give {unknowns} unknowns; record a longer motion with "
            "fewer reversals, and positions that are neither coarse nor repeated"
        )


class NotExcited(IdentificationError):
    """A linear system that does not determine every unknown."""


class NotConverged(IdentificationError):
    """An iterative method that did not converge."""


class Contradiction(IdentificationError):
    """Data that contradict the model or the payload: a sign, a zero, a column or the model is wrong."""


class NoBody(IdentificationError):
    """A link that is not physically consistent."""


class GainsError(IdentificationError):
    """Drive gains that are impossible, of another arm, or missing."""


class LogDescriptionError(IdentificationError):
    """An invalid description of a foreign log."""
