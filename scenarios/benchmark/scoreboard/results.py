"""What `rx90 scoreboard --json` prints."""

from typing import Literal

from pydantic import Field

from scenarios.support.result_model import ResultModel


class BoardGain(ResultModel):
    """A joint of a set, as a method answers.

    Attributes:
        set: Name of the set.
        method: As it was named.
        joint: Its number, from 1.
        gain: [N m / drive unit], null if refused.
        std: Standard deviation [N m / drive unit], null if refused or not stated.
        published: Published gain [N m / drive unit], null if there is none.
        rel_difference: Relative difference, the gain over the published one, less one.
        reason: Why there is no gain.
    """

    set: str
    method: str
    joint: int = Field(ge=1)
    gain: float | None
    std: float | None
    published: float | None
    rel_difference: float | None
    reason: str | None


class BoardRatio(ResultModel):
    """A ratio of gains from bare motions.

    Attributes:
        set: Name of the set.
        joint: Its number, from 1.
        reference: That of the joint whose gain is the unit.
        ratio: Ratio of the gains, null if refused.
        rel_std: Relative standard deviation.
        rel_difference: Relative difference from the ratio of the published gains, null without these.
    """

    set: str
    joint: int = Field(ge=1)
    reference: int = Field(ge=1)
    ratio: float | None
    rel_std: float | None
    rel_difference: float | None


class Agreement(ResultModel):
    """Gains of two sets that share no recording.

    Attributes:
        method: As it was named.
        sets: Their names.
        joints: How many have a gain with a deviation in both.
        within: Of how many the difference is within two of its standard deviations.
        largest: Largest relative difference of a gain.
    """

    method: str
    sets: tuple[str, str]
    joints: int
    within: int
    largest: float | None


class BoardPrediction(ResultModel):
    """A recording that a set does not hold, predicted with gains and the arm of its bare motions.

    Attributes:
        gains: Method that they are from, or `published`.
        set: That the arm, and the method's gains, are from.
        log: The recording.
        joints: Numbers of the joints that are predicted.
        rel_error: Root mean square of their relative errors of the currents.
    """

    gains: str
    set: str
    log: str
    joints: list[int]
    rel_error: float


class BoardWeight(ResultModel):
    """The payload of a set, weighed with gains identified without it.

    Attributes:
        gains: Method that they are from, or `published`.
        gains_set: Set that they were found from, null for published ones.
        set: Whose payload it is, and whose bare motions.
        mass: On the scale [kg].
        found: From currents and gains [kg].
        std: Standard deviation of that, of the gains included [kg].
    """

    gains: str
    gains_set: str | None
    set: str
    mass: float
    found: float
    std: float


class Refusals(ResultModel):
    """What a method refused.

    Attributes:
        method: As it was named.
        given: Gains that it gave.
        refused: Gains that it refused.
        right: Refusals where nothing was weighed, so that no gain can be known.
        wrong: Gains given nevertheless.
        failed: Calls without an answer.
        seconds: Wall time of all calls [s].
    """

    method: str
    given: int
    refused: int
    right: int
    wrong: int
    failed: int
    seconds: float


class SensorGain(ResultModel):
    """Torque of a sensor per unit of what the motor says, joint by joint, friction fitted beside.

    Attributes:
        joint: Its number, from 1.
        sensor: Column of the sensor.
        slope: Sensor over motor [sensor unit / motor unit], null where its relative standard deviation is that of a
            refused gain.
        std: Standard deviation of it from the residuals, taken as white [sensor unit / motor unit].
        rel_error: Norm of the residual relative to that of the sensor's torque.
    """

    joint: int = Field(ge=1)
    sensor: str
    slope: float | None
    std: float | None
    rel_error: float | None


class Entry(ResultModel):
    """One recipe.

    Attributes:
        name: Of the recipe.
        source: Where the recordings are published.
        licence: As their source states it.
        status: Whether its files are there and could be used.
        untried: Whether this project has seen no file of it.
        missing: Files that are not there.
        reason: Why files that are there could not be used.
        get: How to get the recordings.
        notes: What is not said elsewhere.
        published_by: Who states gains.
        gains: One per set, method and joint.
        ratios: One per joint of sets without a payload.
        agreements: One per method and pair of sets.
        predictions: One per recording, set and origin of gains.
        weights: One per set with a payload and origin of gains.
        refusals: One per method.
        sensors: One per sensor.
    """

    name: str
    source: str
    licence: str
    status: Literal["run", "missing", "unusable"]
    untried: bool
    missing: list[str]
    reason: str | None
    get: str
    published_by: str | None
    gains: list[BoardGain] = Field(default_factory=list[BoardGain])
    ratios: list[BoardRatio] = Field(default_factory=list[BoardRatio])
    agreements: list[Agreement] = Field(default_factory=list[Agreement])
    predictions: list[BoardPrediction] = Field(default_factory=list[BoardPrediction])
    weights: list[BoardWeight] = Field(default_factory=list[BoardWeight])
    refusals: list[Refusals] = Field(default_factory=list[Refusals])
    sensors: list[SensorGain] = Field(default_factory=list[SensorGain])
    notes: list[str] = Field(default_factory=list[str])


class Scoreboard(ResultModel):
    """Methods on public recordings.

    Attributes:
        folder: Of the recordings.
        methods: As they were named.
        entries: One per recipe.
    """

    folder: str
    methods: list[str]
    entries: list[Entry]
