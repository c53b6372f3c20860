"""What can go wrong in a simulation: one base class, one class per cause."""


class SimulationError(RuntimeError):
    """Base of every error this package raises on purpose; its message is one line for the user."""


class PlantError(SimulationError):
    """A plant that cannot be built: wrong shapes, impossible values."""


class TrajectoryError(SimulationError):
    """A motion that breaks a limit before anything is simulated."""


class Diverged(SimulationError):
    """The simulated state left all bounds."""


class Saturated(SimulationError):
    """A drive stood at its current limit for too long: the motion asks for more than the arm has."""


class LimitReached(SimulationError):
    """A joint reached the end of its range."""
