"""Versions and files that the rows of a study depend on."""

import hashlib
import platform
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).parents[2]
CODE = ("ident", "sim", "rx90_mjcf", "scenarios")
"""Packages of this project."""
DERIVED = ("__pycache__",)
"""Cache folders of a package."""

PACKAGES = ("rx90-drive-gain-testbench", "mujoco", "numpy", "scipy", "pin", "pandas", "pyarrow")
"""Packages whose versions a study records and does not mix."""
OF_EXTRAS = ("pandas", "pyarrow")
"""Optional ones of these."""
DISTRIBUTIONS = {"mujoco": ("mujoco-core", "mujoco")}
"""Names of a package's distribution, by which it may be installed, if not its own."""


def _version(name: str) -> str | None:
    for each in DISTRIBUTIONS.get(name, (name,)):
        with suppress(PackageNotFoundError):
            return version(each)
    if name in OF_EXTRAS:
        return None
    raise PackageNotFoundError(name)


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Return versions of Python and of packages that results depend on, and a digest of this project's files."""
    code = hashlib.sha256()
    for name, digest in files().items():
        code.update(f"{name} {digest}\n".encode())
    named = {name: found for name in PACKAGES if (found := _version(name)) is not None}
    return {"python": platform.python_version(), **named, "code": code.hexdigest()[:16]}


@lru_cache(maxsize=1)
def files() -> dict[str, str]:
    """Return digests of this project's files: code, robots, drives, payloads, motions, scenarios."""
    return digests(ROOT)


def digests(root: Path) -> dict[str, str]:
    """Return the digest of every file of this project's packages, 16 hexadecimal digits, by its path below `root`.

    Any file may affect a row, so only caches and hidden files are omitted.
    """
    found: dict[str, str] = {}
    for package in CODE:
        for path in sorted((root / package).rglob("*")):
            inside = path.relative_to(root)
            if path.is_file() and not any(part in DERIVED or part.startswith(".") for part in inside.parts):
                found[inside.as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    return found
