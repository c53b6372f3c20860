"""What a command printed with `--json`, held against its schema."""

import json
from functools import cache

import jsonschema
import pytest

from scenarios.cli import main
from scenarios.results.json_schemas import schema


@cache
def _schema(name: str) -> dict:
    return schema(name)


def fits(value: object, name: str) -> None:
    """Fail unless a value fits the schema of that name."""
    jsonschema.Draft202012Validator(_schema(name)).validate(value)


def printed(capsys: pytest.CaptureFixture[str], name: str, words: list[str] | None = None, status: int = 0) -> dict:
    """The object on standard output, of a command if its words are given, which fits the schema of that name."""
    if words is not None:
        capsys.readouterr()
        assert main([*words, "--json"]) == status
    found = json.loads(capsys.readouterr().out)
    fits(found, name)
    return found
