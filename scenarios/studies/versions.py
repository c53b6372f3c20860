"""Versions that the rows of a study depend on."""

import platform
from importlib.metadata import version

PACKAGES = ("rx90-drive-gain-testbench", "mujoco", "numpy", "scipy", "pin", "pandas", "pyarrow")
"""Packages whose versions a study records, and refuses to mix."""


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that results depend on."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}
