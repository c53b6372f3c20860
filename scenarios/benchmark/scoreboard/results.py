"""What `rx90 scoreboard --json` prints."""

from typing import Literal

from pydantic import Field

from scenarios.support.result_model import ResultModel


class BoardGain(ResultModel):
    """A method's answer for a joint of a set.

    Attributes:
        set: Name of the set.
        method: Text that names the method.
        joint: Number of the joint, from 1.
        gain: Gain [N m / drive unit], null if refused.
        std: Standard deviation [N m / drive unit], null if refused or not estimated.
        published: Published gain [N m / drive unit], null if there is none.
        rel_difference: Relative difference: gain over published gain, minus one.
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
        joint: Number of the joint, from 1.
        reference: Number of the reference joint.
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
        method: Text that names the method.
        sets: Names of the sets.
        joints: Number of joints with a gain and a standard deviation in both.
        within: Number of these whose difference is within two of its standard deviations.
        largest: Largest relative difference of a gain.
    """

    method: str
    sets: tuple[str, str]
    joints: int
    within: int
    largest: float | None


class BoardPrediction(ResultModel):
    """Prediction of a recording outside a set, with gains and the arm from the set's bare motions.

    Attributes:
        gains: Method that gave the gains, or `published`.
        set: Set from which the arm and the method's gains are identified.
        log: Name of the recording.
        joints: Numbers of the predicted joints.
        rel_error: Root mean square of their relative current errors.
    """

    gains: str
    set: str
    log: str
    joints: list[int]
    rel_error: float


class BoardWeight(ResultModel):
    """Estimate of a set's payload with gains that were identified without it.

    Attributes:
        gains: Method that gave the gains, or `published`.
        gains_set: Set from which the gains were identified, null for published ones.
        set: Set of the payload and of the bare motions.
        mass: Weighed mass [kg].
        found: Mass from currents and gains [kg].
        std: Standard deviation of `found`, including that of the gains [kg].
    """

    gains: str
    gains_set: str | None
    set: str
    mass: float
    found: float
    std: float


class Refusals(ResultModel):
    """Refusals of a method.

    Attributes:
        method: Text that names the method.
        given: Number of gains given.
        refused: Number of gains refused.
        right: Number of refusals without a weighed payload, where no gain is identifiable.
        wrong: Number of gains given without a weighed payload.
        failed: Number of calls without an answer.
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
    """Torque of a sensor per unit of the motor signal, joint by joint, with fitted friction.

    Attributes:
        joint: Number of the joint, from 1.
        sensor: Column of the sensor.
        slope: Sensor over motor [sensor unit / motor unit], null if its relative standard deviation exceeds the limit
            for gains.
        std: Standard deviation of `slope` for white residuals [sensor unit / motor unit].
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
        name: Name of the recipe.
        source: Publication of the recordings.
        licence: Licence as stated by the source.
        status: Whether its files exist and could be used.
        untried: Whether this project has not read any of its files.
        missing: Missing files.
        reason: Why existing files could not be used.
        get: How to get the recordings.
        notes: Further remarks.
        published_by: Source of the published gains.
        gains: One entry per set, method and joint.
        ratios: One entry per joint of sets without a payload.
        agreements: One entry per method and pair of sets.
        predictions: One entry per recording, set and origin of gains.
        weights: One entry per set with a payload and origin of gains.
        refusals: One entry per method.
        sensors: One entry per sensor.
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
        folder: Folder of the recordings.
        methods: Texts that name the methods.
        entries: One entry per recipe.
    """

    folder: str
    methods: list[str]
    entries: list[Entry]
