"""The Staubli RX-90 as data: an MJCF model, drives and limits, and the payloads of Gautier & Briot (2011).

Every number has its source in its file, and is marked as published, measured or assumed.
"""

from pathlib import Path

FOLDER = Path(__file__).parent
ROBOT = FOLDER / "robot.toml"
"""Nominal drives, limits, couplings, and the model that they belong to."""
MJCF = FOLDER / "rx90.xml"
"""The arm with a bare flange; opens in MuJoCo's viewer."""
PAYLOADS = {
    "7.025 kg": FOLDER / "payload_7025.toml",
    "4.275 kg": FOLDER / "payload_4275.toml",
    "offset": FOLDER / "payload_offset.toml",
}
"""The weighed payloads of the paper and one that loads every joint, in the payload format of `ident`."""
