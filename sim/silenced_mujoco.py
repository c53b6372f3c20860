"""MuJoCo's own log kept off the terminal and out of the working folder: what it has to say is an error of ours."""

from collections.abc import Generator
from contextlib import contextmanager

import mujoco


@contextmanager
def silenced() -> Generator[None]:
    """Without MuJoCo's lines on stderr and in `MUJOCO_LOG.TXT`, whatever thread they come from; also a decorator."""
    before, config = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    config.set()
    try:
        yield
    finally:
        before.set()
