"""Errors of simulations: one base class, one class per cause; each message is one line for the user."""


class SimulationError(RuntimeError):
    """Base of every error this package raises on purpose.

    Attributes:
        joint: The joint, from 0; None if it is not of one joint.
        value: The refused number, None if there is none.
        bounds: Smallest and largest number that is allowed, infinite without a limit; None without a number.
    """

    def __init__(
        self,
        message: str,
        *,
        joint: int | None = None,
        value: float | None = None,
        bounds: tuple[float, float] | None = None,
    ) -> None:
        """State the message and the numbers in it."""
        super().__init__(message)
        self.joint, self.value, self.bounds = joint, value, bounds


class PlantError(SimulationError):
    """A robot, model, plant, controller or sensor that is impossible, or that cannot be read, compiled or drawn."""


NO_POSITION, SATURATED, LIMIT_REACHED, DIVERGED = "NoPosition", "Saturated", "LimitReached", "Diverged"
"""Kinds of `TrajectoryError`, as studies count them."""


class TrajectoryError(SimulationError):
    """A motion that the robot cannot follow, found before or in its simulation.

    Attributes:
        kind: `NoPosition` (no feasible start), `Saturated` (a drive at its limit for too long), `LimitReached` (a joint
            at the end of its range), `Diverged` (the state left all bounds), or `TrajectoryError` (any other limit).
    """

    def __init__(
        self,
        message: str,
        *,
        kind: str = "TrajectoryError",
        joint: int | None = None,
        value: float | None = None,
        bounds: tuple[float, float] | None = None,
    ) -> None:
        """State the message, the kind and the numbers."""
        super().__init__(message, joint=joint, value=value, bounds=bounds)
        self.kind = kind


ADVICE = "install EGL (libegl1, libgl1-mesa-dri) or OSMesa (libosmesa6), and set MUJOCO_GL=egl or osmesa"
"""Advice if nothing can be rendered, with names of Debian packages."""
