"""Standard output of a command."""

import sys

from rich.console import Console


def terminal() -> Console:
    """A console that wraps at words on a terminal, and not at all into a pipe or file."""
    if sys.stdout.isatty():
        return _Console(highlight=False, markup=False)
    return _Console(highlight=False, markup=False, soft_wrap=True, width=200)


class _Console(Console):
    """A console whose reader may leave."""

    def on_broken_pipe(self) -> None:
        """Leave the exit status to the command line; Rich would say 1, which is a missed tolerance here."""
        raise BrokenPipeError
