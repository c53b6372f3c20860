"""What can go wrong in a simulation: one base class, one class per cause."""


class SimulationError(RuntimeError):
    """Base of every error this package raises on purpose; its message is one line for the user."""


class PlantError(SimulationError):
    """Base of what keeps a plant, its controller or its sensors from being built."""


class RobotError(PlantError):
    """A robot file that cannot be read, or whose parts do not fit each other."""


class PayloadBodyError(PlantError):
    """A payload whose numbers are beyond any robot."""


class ModelFileError(PlantError):
    """A model file that MuJoCo cannot compile, or that is of another arm."""


class DriveError(PlantError):
    """Drives with wrong shapes or impossible values."""


class EffectError(PlantError):
    """A model error that is out of range, or that this robot, its drives or the step do not allow."""


class ControllerError(PlantError):
    """A controller with impossible values, or one that believes in another arm."""


class SensorError(PlantError):
    """Sensors with impossible values, or ones that do not fit the rate."""


class StepError(PlantError):
    """A physics step that does not fit the control period."""


class TooLong(PlantError):
    """An experiment that would take more memory or time than anybody has."""


class SequenceError(PlantError):
    """A motion of a robot with a memory, without the motion before it."""


class LooseTransmission(PlantError):
    """A transmission with play where a motion is to follow from torque alone."""


class NoCurrent(PlantError):
    """A plant whose friction takes all that a current gives."""


class TrajectoryError(SimulationError):
    """A motion that breaks a limit before anything is simulated."""


class NoPositionError(TrajectoryError):
    """No position that a motion may begin at."""


class Diverged(SimulationError):
    """The simulated state left all bounds."""


class Saturated(SimulationError):
    """A drive stood at its current limit for too long: the motion asks for more than the arm has."""


class LimitReached(SimulationError):
    """A joint reached the end of its range."""


class NoPicture(SimulationError):
    """A scene that cannot be shown: no window, or nothing to draw with."""


ADVICE = "install EGL (libegl1, libgl1-mesa-dri) or OSMesa (libosmesa6), and set MUJOCO_GL=egl or osmesa"
"""What to do where nothing can be drawn, by the names of Debian's packages."""
