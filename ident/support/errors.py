"""What can go wrong in identification: one base class, one class per cause."""


class IdentificationError(ValueError):
    """Base of every error this package raises on purpose; its message is one line for the user."""


class RecordingError(IdentificationError):
    """A recording that cannot be used as it stands.

    Attributes:
        reason: Why; the message has the recording's name before it, where that is given.
    """

    def __init__(self, reason: str, recording: str = "") -> None:
        """State why, and of which recording."""
        super().__init__(f"{recording}: {reason}" if recording else reason)
        self.reason = reason


class RobotModelError(IdentificationError):
    """A robot model that is unreadable or is not a fixed-base serial arm."""


class PayloadError(IdentificationError):
    """A payload description that is incomplete, mistyped or physically impossible."""


class NotIdentifiable(IdentificationError):
    """Data that cannot give a single drive gain, whatever the joint."""


class NegativeMass(IdentificationError):
    """A mass found that is below zero beyond doubt."""


class OptionError(IdentificationError):
    """An option of the identification that does not exist or has a value that makes no sense."""


class TooFewRows(IdentificationError):
    """A linear system with too few equations for its unknowns."""


class NotExcited(IdentificationError):
    """A linear system that does not show every unknown: the motion leaves some of them free."""


class NotConverged(IdentificationError):
    """A search that found no end."""


class Contradiction(IdentificationError):
    """Data that fit no arm of this model with this payload: a sign, a zero, a column or the model is mistaken."""


class NoBody(IdentificationError):
    """A link that no rigid body can be, where one is needed."""


class GainsError(IdentificationError):
    """Drive gains that no drives have, that are of another arm, or that are missing where they are needed."""


class LogDescriptionError(IdentificationError):
    """What is said of a foreign log cannot be meant."""
