"""Errors of simulations: one base class, one class per cause; each message is one line for the user."""

from ident.support.errors import ProjectError


class SimulationError(ProjectError, RuntimeError):
    """Base of every error this package raises on purpose."""


class PlantError(SimulationError):
    """A robot, model, plant, controller or sensor that is impossible, or that cannot be read, compiled or drawn."""


class TrajectoryError(SimulationError):
    """A motion that the robot cannot follow, found before or in its simulation."""


class NoPosition(TrajectoryError):
    """No feasible start of a motion."""


class Saturated(TrajectoryError):
    """A drive at its limit for too long."""


class LimitReached(TrajectoryError):
    """A joint at the end of its range."""


class Diverged(TrajectoryError):
    """A state that left all bounds."""


ADVICE = "install EGL (libegl1, libgl1-mesa-dri) or OSMesa (libosmesa6), and set MUJOCO_GL=egl or osmesa"
"""Advice if nothing can be rendered, with names of Debian packages."""
