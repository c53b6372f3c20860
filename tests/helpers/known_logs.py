"""Recordings whose gains are known: inverse dynamics by Pinocchio along a Fourier motion, friction, offsets, noise."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ident.model.arm import Arm, arm_from_pinocchio
from ident.payload.payload import Payload
from ident.recordings.recording import Motion, Recording

UR_GAIN = np.array([13.2, -12.1, 9.7, 8.3, 6.9, 7.7])
"""Of the UR-like arm [N m / A]; axis 2 is wired backwards."""
UR_MIDDLE = np.array([0.3, -1.2, 1.1, -0.4, 0.7, 0.2])
BRICK = Payload(mass=4.3, com=(0.07, -0.05, 0.11), inertia=(0.021, 0.017, 0.012, 0.002, -0.001, 0.003), mass_std=0.005)


def ur_like(gravity: tuple[float, float, float] = (0.0, 0.0, -9.81), count: int = 6) -> pin.Model:
    """Up to six axes in the arrangement of a UR10, links of lopsided inertia."""
    model = pin.Model()
    model.name = "ur-like"
    model.gravity = pin.Motion(np.array(gravity), np.zeros(3))
    turn = pin.utils.rotate("y", np.pi / 2)
    places = [
        (np.eye(3), (0.0, 0.0, 0.128)),
        (turn, (0.0, 0.22, 0.0)),
        (np.eye(3), (0.0, -0.171, 0.612)),
        (turn, (0.0, 0.0, 0.572)),
        (np.eye(3), (0.0, 0.115, 0.0)),
        (np.eye(3), (0.0, 0.0, 0.116)),
    ]
    axes = [(0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0)]
    masses = [7.8, 12.9, 3.9, 2.0, 1.9, 0.4]
    coms = [(0.01, -0.02, -0.03), (0.02, -0.04, 0.24), (0.01, 0.03, 0.26), (0.01, 0.02, 0.03)]
    coms += [(-0.01, 0.02, 0.02), (0.006, -0.01, 0.004)]
    for j in range(count):
        place = pin.SE3(places[j][0], np.array(places[j][1]))
        axis = np.array(axes[j], dtype=float)
        index = model.addJoint(j, pin.JointModelRevoluteUnaligned(axis), place, f"joint{j + 1}")
        size = masses[j] * 0.02
        inertia = np.array([[1.1, 0.1, -0.05], [0.1, 0.9, 0.07], [-0.05, 0.07, 0.8]]) * size
        model.appendBodyToJoint(index, pin.Inertia(masses[j], np.array(coms[j]), inertia), pin.SE3.Identity())
    return model


def with_payload(model: pin.Model, payload: Payload | None) -> pin.Model:
    """The arm with a payload on its last link."""
    heavy = model.copy()
    if payload is not None:
        ixx, iyy, izz, ixy, ixz, iyz = payload.inertia or (0.0,) * 6
        about = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        body = pin.Inertia(payload.mass, np.array(payload.com or (0.0,) * 3), about)
        heavy.appendBodyToJoint(heavy.nv, body, pin.SE3.Identity())
    return heavy


def torque(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Inverse dynamics, (N, n)."""
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])


@dataclass(frozen=True)
class Fourier:
    """q = middle + sum_k amplitude_k sin(k w t + phase_k), one row a joint."""

    middle: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    period: float

    def __call__(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        k = np.arange(1, self.amplitude.shape[1] + 1)
        w = 2.0 * np.pi * k / self.period
        angle = t[:, None, None] * w + self.phase
        q = self.middle + (self.amplitude * np.sin(angle)).sum(axis=2)
        dq = (self.amplitude * w * np.cos(angle)).sum(axis=2)
        ddq = -(self.amplitude * w**2 * np.sin(angle)).sum(axis=2)
        return q, dq, ddq


def fourier(rng: np.random.Generator, middle: np.ndarray, *, harmonics: int = 10, size: float = 0.5) -> Fourier:
    """A random motion of 20 s about `middle`, faster harmonics smaller."""
    shape = (len(middle), harmonics)
    amplitude = size * rng.uniform(0.5, 1.0, shape) / np.arange(1, harmonics + 1)
    return Fourier(middle, amplitude, rng.uniform(-np.pi, np.pi, shape), 20.0)


def known_logs(
    model: pin.Model,
    payload: Payload,
    gain: np.ndarray,
    rng: np.random.Generator,
    *,
    middle: np.ndarray,
    noise: float = 0.02,
    rate: float = 125.0,
    transmission: np.ndarray | None = None,
) -> tuple[Recording, Recording]:
    """A bare and a loaded recording of an arm whose drive gains are `gain`.

    Noise is white, in proportion to each joint's rms current; friction is viscous and dry, with an offset. Motors
    that several joints turn, q_motor = A q with A the transmission, are logged themselves.
    """
    motion = fourier(rng, middle)
    scale, t = 0.8 * np.abs(gain), np.arange(0.0, motion.period, 1.0 / rate)
    q, dq, ddq = motion(t)
    A = np.eye(len(middle)) if transmission is None else transmission
    turned, dturned, ddturned = (x @ A.T for x in (q, dq, ddq))
    recordings = []
    for each, name in ((None, "bare"), (payload, "loaded")):
        tau = torque(with_payload(model, each), q, dq, ddq)
        tau = np.linalg.solve(A.T, tau.T).T  # torques of the joints are A' times those of the motors
        tau = tau + scale * (1.3 * dturned + 1.7 * np.sign(dturned) + 0.4) + 0.01 * scale * ddturned
        v = tau / gain
        v = v + noise * np.sqrt(np.mean(v**2, axis=0)) * rng.standard_normal(v.shape)
        recordings.append(Recording(t, turned, v, name))
    return recordings[0], recordings[1]


def arm_of(model: pin.Model) -> Arm:
    """Its kinematics, as identification sees them."""
    return arm_from_pinocchio(model)


def mounted(bare: Recording, loaded: Recording, payload: Payload) -> tuple[Motion, Motion]:
    """A bare and a loaded motion."""
    return Motion(bare), Motion(loaded, payload)
