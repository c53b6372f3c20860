"""Text for messages: nearest known name, values in one short line, the command that installs a missing package."""

import difflib
import reprlib
from collections.abc import Iterable, Sequence

LONGEST = 60
"""Largest number of characters of a value in a message."""
PROJECT = "rx90-drive-gain-testbench"
EXTRAS: dict[str, tuple[str, str]] = {
    "pyarrow": ("parquet", "Parquet files and --save"),
    "jinja2": ("pages", "pages"),
    "cma": ("study", "searches"),
    "filelock": ("study", "studies"),
    "matplotlib": ("study", "figures"),
    "pandas": ("study", "studies"),
    "h5py": ("hdf5", "HDF5 files, and MATLAB's of version 7.3"),
    "rosbags": ("ros", "ROS 2 bags and MCAP files"),
    "imageio": ("film", "MP4"),
    "imageio_ffmpeg": ("film", "MP4"),
    "PIL": ("film", "pictures"),
    "OpenGL": ("film", "pictures"),
    "glfw": ("film", "windows"),
    "distributed": ("cluster", "Dask"),
}
"""By import name: the extra, and its use."""


def nearest(key: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` for the nearest known key, empty if none is near."""
    close = difflib.get_close_matches(key, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def shown(value: object) -> str:
    """Return the representation of a value on one line, shortened in the middle if long."""
    text = _SHORT.repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2 - 2]}...{text[2 - LONGEST // 2 :]}"


def one_line(text: object) -> str:
    """Return text without line breaks or control characters, for file names and messages of libraries."""
    return "".join(c if c.isprintable() else " " for c in str(text)).strip()


class _Short(reprlib.Repr):
    """Whole numbers beyond Python's limit of digits are replaced by their size."""

    def repr_int(self, x: int, level: int) -> str:
        """Return a whole number, or its number of bits."""
        return repr(x) if x.bit_length() <= 128 else f"a whole number of {x.bit_length()} bits"


_SHORT = _Short()
_SHORT.maxstring = _SHORT.maxother = LONGEST


def enumerated(words: Sequence[str]) -> str:
    """`a`, `a and b` or `a, b and c`."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if words[1:] else words[0]


def joint_list(joints: Sequence[int]) -> str:
    """`joint 2` or `joints 2, 3 and 5`, of joints from 0."""
    return f"{'joints' if joints[1:] else 'joint'} {enumerated([str(joint + 1) for joint in joints])}"


def needed_extra(package: str | None, wider: str | None = None) -> str | None:
    """Return the message for a missing package or module, None if it is in no extra; a wider extra may include it."""
    name = (package or "").partition(".")[0]
    if name not in EXTRAS:
        return None
    extra, what = EXTRAS[name]
    return f"{name} is not installed, which is needed for {what}: pip install '{PROJECT}[{wider or extra}]'"
