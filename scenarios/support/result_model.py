"""What every result that a command prints begins with: a pydantic model whose JSON object may have further keys."""

import json
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict


class ResultModel(BaseModel):
    """A JSON object that may have more keys than these.

    Its fields are the contract: JSON (`model_dump(mode="json")`), JSON Schema and reading back follow from them.
    """

    model_config = ConfigDict(extra="allow", defer_build=True)  # a command uses few of those that it imports


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite would be no JSON and is an error."""
    return json.dumps(document, indent=2, allow_nan=False)
