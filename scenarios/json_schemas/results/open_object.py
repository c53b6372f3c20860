"""What every result's schema begins with: an object that may have more keys than those that it names."""

from pydantic import BaseModel, ConfigDict


class OpenObject(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow")
