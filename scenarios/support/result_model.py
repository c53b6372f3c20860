"""Base of all results that commands print: a pydantic model whose JSON object may have further keys."""

import json
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict


class ResultModel(BaseModel):
    """A JSON object that may have more keys than these.

    Its fields define JSON (`model_dump(mode="json")`), JSON Schema and reading.
    """

    model_config = ConfigDict(extra="allow", defer_build=True)  # a command uses few of those that it imports


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite is an error, as JSON has none."""
    return json.dumps(document, indent=2, allow_nan=False)
