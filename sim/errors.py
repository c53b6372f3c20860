"""Errors of simulations: one base class, one class per cause."""


class SimulationError(RuntimeError):
    """Base of every error this package raises on purpose; its message is one line for the user."""


class PlantError(SimulationError):
    """Base of errors in the definition of a plant, controller or sensors."""


class RobotError(PlantError):
    """A robot file that cannot be read, or whose parts do not fit each other."""


class PayloadBodyError(PlantError):
    """A payload with values out of range."""


class ModelFileError(PlantError):
    """A model file that MuJoCo cannot compile, or that is of another arm."""


class DriveError(PlantError):
    """Drives with wrong shapes or impossible values."""


class EffectError(PlantError):
    """A model error that is out of range, or that this robot, its drives or the step do not allow."""


class ControllerError(PlantError):
    """A controller with impossible values, or with the model of a different arm."""


class SensorError(PlantError):
    """Sensors with impossible values, or ones that do not fit the rate."""


class StepError(PlantError):
    """A physics step that does not fit the control period."""


class TooLong(PlantError):
    """An experiment that exceeds the limits of memory or time."""


class SequenceError(PlantError):
    """A motion of a robot with warming drives, without the preceding motion."""


class LooseTransmission(PlantError):
    """A transmission with backlash where the motion must follow from the torque alone."""


class NoCurrent(PlantError):
    """A plant whose friction equals or exceeds the drive torque."""


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
