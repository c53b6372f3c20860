"""The answer of a method, validated strictly: the gains of the JSON object of `rx90 identify --json`."""

import json
import math
from typing import NoReturn

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.support.naming import one_line, shown
from scenarios.experiments.judge import Claim
from scenarios.support.errors import ImpossibleGain, NoAnswer, NotFinite, WrongForm, WrongJoints


class AnswerGain(BaseModel):
    """One joint's gain: `estimate`, and `std` if the method estimates one; null for a refused joint."""

    model_config = ConfigDict(extra="allow")
    joint: int = Field(ge=1, description="Number of the joint, from 1")
    estimate: float | None = Field(description="Estimated gain [N m / drive unit], null if refused")
    std: float | None = Field(
        description="Standard deviation of the gain [N m / drive unit], null if refused or not estimated"
    )
    identifiable: bool = Field(description="Whether there is a gain")
    reason: str | None = Field(None, description="Why there is no gain")


class AnswerFile(BaseModel):
    """Output of a method: one gain per joint, in order; other keys are ignored."""

    model_config = ConfigDict(extra="allow")
    gains: list[AnswerGain] = Field(description="One entry per joint, in order")


def read_answer(text: str, joints: int) -> tuple[Claim, ...]:
    """Read an answer.

    Raises:
        NoAnswer: If it is not a JSON object.
        NotFinite: If a number is not finite.
        WrongForm: If a key is missing or a value has the wrong type.
        WrongJoints: If the joints are not those of the arm, in order.
        ImpossibleGain: If the entry of a joint is contradictory or impossible.
    """
    if not text.strip():
        raise NoAnswer("it printed nothing")
    try:
        found = json.loads(text, parse_constant=_not_finite)
    except (json.JSONDecodeError, RecursionError) as error:
        raise NoAnswer(f"it printed no JSON: {shown(text.strip())}") from error
    if not isinstance(found, dict):
        raise NoAnswer(f"it printed {shown(text.strip())}; expected one JSON object")
    try:
        answer = AnswerFile.model_validate(found, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise WrongForm(f"{where}: {one_line(first['msg'][0].lower() + first['msg'][1:])}") from error
    numbers = [gain.joint for gain in answer.gains]
    if numbers != list(range(1, joints + 1)):
        raise WrongJoints(f"gains of joints {shown(numbers)}; expected 1 to {joints}, in this order")
    return tuple(map(_claim, answer.gains))


def _claim(gain: AnswerGain) -> Claim:
    for name in ("estimate", "std"):
        value = getattr(gain, name)
        if value is not None and not math.isfinite(value):
            raise NotFinite(f"joint {gain.joint}: {name} is {value}")
    if not gain.identifiable:
        if gain.estimate is not None or gain.std is not None:
            raise ImpossibleGain(f"joint {gain.joint} is refused but has a number; give null")
        return Claim(None, None, gain.reason)
    if not gain.estimate:
        raise ImpossibleGain(f"joint {gain.joint}: a gain of {gain.estimate} is invalid; refuse the joint instead")
    if gain.std is not None and gain.std < 0.0:
        raise ImpossibleGain(f"joint {gain.joint}: a standard deviation of {gain.std:g}")
    return Claim(gain.estimate, gain.std, None)


def _not_finite(name: str) -> NoReturn:
    raise NotFinite(f"a number is {name}")
