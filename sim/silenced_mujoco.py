"""Suppression of MuJoCo's log on terminal and in the working folder; messages become errors of this package."""

from collections.abc import Generator
from contextlib import contextmanager

import mujoco


@contextmanager
def silenced() -> Generator[None]:
    """Suppress MuJoCo's lines on stderr and in `MUJOCO_LOG.TXT`, from all threads; also a decorator."""
    before, config = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    config.set()
    try:
        yield
    finally:
        before.set()
