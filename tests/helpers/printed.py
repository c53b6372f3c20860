"""What a command printed with `--json`, held against its schema."""

import json

import jsonschema
import pytest

from scenarios.support.toml_text import ENDING, FOLDER


def fits(value: object, name: str) -> None:
    """Fail unless a value fits the shipped schema of that name."""
    jsonschema.Draft202012Validator(json.loads((FOLDER / f"{name}{ENDING}").read_text())).validate(value)


def printed(capsys: pytest.CaptureFixture[str], name: str) -> dict:
    """The object on standard output, which fits the schema of that name."""
    found = json.loads(capsys.readouterr().out)
    fits(found, name)
    return found
