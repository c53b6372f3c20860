"""What every result that a command prints begins with: a pydantic model whose JSON object may have further keys."""

from pydantic import BaseModel, ConfigDict


class ResultModel(BaseModel):
    """A JSON object that may have more keys than these.

    Its fields are the contract: JSON (`model_dump_json`), JSON Schema and reading back follow from them.
    """

    model_config = ConfigDict(extra="allow")
