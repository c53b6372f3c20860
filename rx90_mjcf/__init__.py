"""The Staubli RX-90 as data: an MJCF model, nominal drives and the payloads of Gautier & Briot (2011).

Every number carries its source in the file that holds it, or the word "assumed".
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

FOLDER = Path(__file__).parent
MJCF = FOLDER / "rx90.xml"
"""The arm with a bare flange; opens in MuJoCo's viewer."""
DRIVES = FOLDER / "drives.toml"
PAYLOADS = {
    "7.025 kg": FOLDER / "payload_7025.toml",
    "4.275 kg": FOLDER / "payload_4275.toml",
    "offset": FOLDER / "payload_offset.toml",
}
"""The weighed payloads of the paper and one that loads every joint, in the payload format of `ident`."""


@dataclass(frozen=True, slots=True, eq=False)
class Drives:
    """Drives of six joints, on the joint side; every array has shape (6,).

    Attributes:
        gain: Joint torque per unit of current reference [N m / drive unit].
        rotor_inertia: Ia [kg m^2].
        viscous_friction: Fv [N m s/rad].
        coulomb_friction: Fc [N m].
        coulomb_asymmetry: Fcoff, friction torque that does not change sign [N m].
        amplifier_offset: v0 [drive units].
        current_limit: Largest current reference [drive units].
        max_velocity: [rad/s].
        max_acceleration: [rad/s^2].
    """

    gain: npt.NDArray[np.float64]
    rotor_inertia: npt.NDArray[np.float64]
    viscous_friction: npt.NDArray[np.float64]
    coulomb_friction: npt.NDArray[np.float64]
    coulomb_asymmetry: npt.NDArray[np.float64]
    amplifier_offset: npt.NDArray[np.float64]
    current_limit: npt.NDArray[np.float64]
    max_velocity: npt.NDArray[np.float64]
    max_acceleration: npt.NDArray[np.float64]


def nominal_drives() -> Drives:
    """The nominal drives of `drives.toml`."""
    table = tomllib.loads(DRIVES.read_text(encoding="utf-8"))
    return Drives(**{name: np.array(entry["value"], dtype=np.float64) for name, entry in table.items()})
