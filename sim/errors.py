"""Errors of simulations: one base class, one class per cause; each message is one line for the user."""


class SimulationError(RuntimeError):
    """Base of every error this package raises on purpose."""


class PlantError(SimulationError):
    """A plant, controller, sensor or step with impossible values, or whose parts do not fit each other."""


class RobotError(PlantError):
    """A robot file that cannot be read, or whose parts do not fit each other."""


class ModelFileError(PlantError):
    """A model file that MuJoCo cannot compile, or that is of another arm."""


class TrajectoryError(SimulationError):
    """A motion that violates a limit, found before the simulation."""


class NoPositionError(TrajectoryError):
    """No feasible start position of a motion."""


class Diverged(SimulationError):
    """The simulated state left all bounds."""


class Saturated(SimulationError):
    """A drive was at its current limit for too long: the motion needs too much torque."""


class LimitReached(SimulationError):
    """A joint reached the end of its range."""


class NoPicture(SimulationError):
    """A scene that cannot be shown: no window, or no OpenGL."""


ADVICE = "install EGL (libegl1, libgl1-mesa-dri) or OSMesa (libosmesa6), and set MUJOCO_GL=egl or osmesa"
"""Advice if nothing can be rendered, with names of Debian packages."""
