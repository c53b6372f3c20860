"""What a command printed with `--json`, held against its schema."""

import json
from functools import cache

import jsonschema
import pytest

from scenarios.results.json_schemas import schema


@cache
def _schema(name: str) -> dict:
    return schema(name)


def fits(value: object, name: str) -> None:
    """Fail unless a value fits the schema of that name."""
    jsonschema.Draft202012Validator(_schema(name)).validate(value)


def printed(capsys: pytest.CaptureFixture[str], name: str) -> dict:
    """The object on standard output, which fits the schema of that name."""
    found = json.loads(capsys.readouterr().out)
    fits(found, name)
    return found
