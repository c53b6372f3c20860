"""Recordings of a three-axis arm whose friction grows with load, bends with speed, and whose joints may yield."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from known_logs import fourier, torque, ur_like, with_payload
from scipy.interpolate import make_interp_spline

from ident.payload.payload import Payload
from ident.recordings.recording import Recording

GAIN = np.array([13.2, -12.1, 9.7])
MIDDLE = np.array([0.3, -1.0, 0.9])
RATE = 125.0


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What the drives have, joint by joint.

    Attributes:
        Fv, Fc, off: Viscous and Coulomb friction, offset [N m s/rad, N m].
        cbrt: Friction per cube root of the speed.
        by_direction: Friction per absolute speed.
        load_motor: Dry friction per motor torque.
        load: Dry friction per torque of links and payload.
        load_through: Dry friction per torque of links, payload and other friction.
        compliance: Of the transmission [rad/(N m)].
    """

    Fv: tuple[float, ...] = (9.0, 11.0, 6.0)
    Fc: tuple[float, ...] = (11.0, 8.0, 5.0)
    off: tuple[float, ...] = (1.0, -2.0, 0.7)
    cbrt: tuple[float, ...] = (0.0, 0.0, 0.0)
    by_direction: tuple[float, ...] = (0.0, 0.0, 0.0)
    load_motor: tuple[float, ...] = (0.0, 0.0, 0.0)
    load: tuple[float, ...] = (0.0, 0.0, 0.0)
    load_through: tuple[float, ...] = (0.0, 0.0, 0.0)
    compliance: tuple[float, ...] = (0.0, 0.0, 0.0)

    def motor_torque(self, rigid: np.ndarray, dq: np.ndarray) -> np.ndarray:
        """Torque of the motors, (N, 3), by fixed-point iteration of T = needed + load_motor |T| sign(dq)."""
        turns = np.sign(dq)
        needed = rigid + np.array(self.Fv) * dq + np.array(self.Fc) * turns + np.array(self.off)
        needed = needed + np.array(self.cbrt) * np.cbrt(dq) + np.array(self.by_direction) * np.abs(dq)
        through = np.array(self.load_through) * np.abs(needed)
        needed = needed + (np.array(self.load) * np.abs(rigid) + through) * turns
        T = needed
        for _ in range(60):
            T = needed + np.array(self.load_motor) * np.abs(T) * turns
        return T


def three_axes() -> pin.Model:
    """The first three axes of the UR-like arm."""
    return ur_like(count=3)


def real_logs(
    truth: Truth,
    payloads: Sequence[Payload | None],
    rng: np.random.Generator,
    *,
    noise: float = 0.01,
    encoder: float = 0.0,
) -> list[Recording]:
    """One recording a payload, motions of their own; encoders are on the motors, noise is white, theirs in rad."""
    model, logs = three_axes(), list[Recording]()
    for payload in payloads:
        motion = fourier(rng, MIDDLE)
        heavy, t = with_payload(model, payload), np.arange(0.0, motion.period, 1.0 / RATE)
        link = motion(t)
        rigid = torque(heavy, *link)
        yielding = make_interp_spline(t, rigid, k=5)
        q, dq, _ = (x + np.array(truth.compliance) * yielding.derivative(k)(t) for k, x in enumerate(link))
        v = truth.motor_torque(rigid, dq) / GAIN
        v = v + noise * np.sqrt(np.mean(v**2, axis=0)) * rng.standard_normal(v.shape)
        q = q + encoder * rng.spawn(1)[0].standard_normal(q.shape)
        logs.append(Recording(t, q, v, "loaded" if payload else "bare"))
    return logs
