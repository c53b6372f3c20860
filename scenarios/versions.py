"""Versions that the rows of a study depend on."""

import hashlib
import platform
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
CODE = ("ident", "sim", "rx90_mjcf", "scenarios")
"""Packages of this project, beside each other."""

PACKAGES = ("rx90-drive-gain-testbench", "mujoco", "numpy", "scipy", "pin", "pandas", "pyarrow")
"""Packages whose versions a study records, and refuses to mix."""


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of Python, of the packages that results depend on, and a digest of this project's own code."""
    code = hashlib.sha256()
    for package in CODE:
        for path in sorted((ROOT / package).rglob("*")):
            if path.suffix in (".py", ".xml"):
                code.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    named = {name: version(name) for name in PACKAGES}
    return {"python": platform.python_version(), **named, "code": code.hexdigest()[:16]}
