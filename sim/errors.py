"""Errors of simulations: one base class, one class per cause; each message is one line for the user."""

from ident.support.errors import ProjectError


class SimulationError(ProjectError, RuntimeError):
    """Base of every error this package raises on purpose."""


class PlantError(SimulationError):
    """A robot, model, plant, controller or sensor that is impossible, or that cannot be read, compiled or drawn."""


NO_POSITION, SATURATED, LIMIT_REACHED, DIVERGED = "NoPosition", "Saturated", "LimitReached", "Diverged"
"""Kinds of `TrajectoryError`: no feasible start, a drive at its limit for too long, a joint at the end of its range, a
state that left all bounds."""


class TrajectoryError(SimulationError):
    """A motion that the robot cannot follow, found before or in its simulation; `kind` says why."""


ADVICE = "install EGL (libegl1, libgl1-mesa-dri) or OSMesa (libosmesa6), and set MUJOCO_GL=egl or osmesa"
"""Advice if nothing can be rendered, with names of Debian packages."""
