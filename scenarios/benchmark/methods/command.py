"""Methods in any language: `exec: COMMAND` receives the folder as its last argument and prints the answer."""

import shlex
import shutil
from pathlib import Path

from ident.support.naming import shown
from scenarios.benchmark.methods.method import Method, digests
from scenarios.support.errors import ScenarioError

PREFIX = "exec:"


def method(text: str) -> Method | None:
    """Return the method of a text, None if the text is not a command.

    Raises:
        ScenarioError: If the command is empty, badly quoted or not found.
    """
    if not text.startswith(PREFIX):
        return None
    try:
        words = shlex.split(text.removeprefix(PREFIX))
    except ValueError as error:
        raise ScenarioError(f"method {shown(text)}: {str(error).lower()}") from error
    if not words:
        raise ScenarioError(f"method {shown(text)}: no command; expected exec: COMMAND")
    program = shutil.which(words[0])
    if program is None:
        raise ScenarioError(f"method {shown(text)}: program not found: {shown(words[0])}")
    given = [Path(word) for word in words[1:] if Path(word).is_file()]
    return Method(text, (str(Path(program).absolute()), *words[1:]), digests([Path(program), *given]))
