"""What `rx90 identify --json` says of bare motions: friction in drive units, base parameters over a gain."""

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.support.file_access import read_bytes
from ident.support.naming import one_line
from ident.support.toml_files import LARGEST
from scenarios.results.models.links import Links
from scenarios.support.errors import ScenarioError


class _Part(BaseModel):
    """Keys of the contract that are needed here; others may stand beside them."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Found(_Part):
    """A parameter."""

    parameter: str
    estimate: float
    std: float = Field(ge=0.0)


class JointPart(_Part):
    """A joint."""

    joint: int
    name: str
    friction: tuple[Found, ...]


class BareFile(_Part):
    """The arm as bare motions show it.

    Attributes:
        reference: Joint, from 1, whose gain is the unit of the base parameters.
        joints: In their order.
        base_parameters: Over the gain of the reference.
        consistent: Links that bodies can have, None where there are none.
        consistent_reason: Why there are none.
    """

    reference: int = Field(ge=1)
    joints: tuple[JointPart, ...] = Field(min_length=1)
    base_parameters: tuple[Found, ...]
    consistent: Links | None = None
    consistent_reason: str | None = None


def read_bare(path: Path) -> BareFile:
    """Read what was found from bare motions.

    Raises:
        ScenarioError: If it is missing or holds something else; one line.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=ScenarioError)
    try:
        return BareFile.model_validate_json(content, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ScenarioError(
            f"{one_line(path)}: {place + ': ' if place else ''}{one_line(first['msg'])}; expected what `rx90 identify "
            "--model ROBOT --unloaded A --json` prints of bare motions"
        ) from error
