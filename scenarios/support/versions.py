"""Versions and files that the rows of a study depend on."""

import hashlib
import platform
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).parents[2]
CODE = ("ident", "sim", "rx90_mjcf", "scenarios")
"""Packages of this project."""
PACKAGES = ("rx90-drive-gain-testbench", "mujoco", "numpy", "scipy", "pin", "pandas", "pyarrow")
"""Packages whose versions a study records and does not mix."""
OF_EXTRAS = ("pandas", "pyarrow")
"""Optional ones of these."""
DISTRIBUTIONS = {"mujoco": ("mujoco-core", "mujoco")}
"""Names of a package's distribution, by which it may be installed, if not its own."""


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Return versions of Python and of packages that results depend on, and a digest of this project's files."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        for known in DISTRIBUTIONS.get(name, (name,)):
            try:
                found.setdefault(name, version(known))
            except PackageNotFoundError:
                continue
        if name not in found and name not in OF_EXTRAS:
            raise PackageNotFoundError(name)
    code = hashlib.sha256()
    for name, digest in files().items():
        code.update(f"{name} {digest}\n".encode())
    return {**found, "code": code.hexdigest()[:16]}


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
            if path.is_file() and not any(part == "__pycache__" or part.startswith(".") for part in inside.parts):
                found[inside.as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    return found
