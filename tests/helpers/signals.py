"""Signals as a shell's foreground leaves them."""

import signal


def as_in_the_foreground() -> None:
    """Ignore none, in a child about to start: what runs under nohup or behind `&` passes on that it ignores them."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
