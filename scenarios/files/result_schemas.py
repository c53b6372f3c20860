"""JSON Schema of what commands print with `--json`, besides `run`, `identify` and `check`.

Every object may have more keys than these; those that stand here are a contract.
"""

from pydantic import BaseModel, ConfigDict, Field

from scenarios.comparison.statistics import MethodSummary
from scenarios.patching.link_document import Links
from scenarios.patching.places import Change
from scenarios.store.answers import AnswerRow
from scenarios.studies.budget import SourceCost
from scenarios.studies.statistics import JointStatistics


class _Open(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow")


class ListedScenario(_Open):
    """A built-in scenario."""

    name: str
    description: str


class ListedScenarios(_Open):
    """What `rx90 list --json` prints."""

    scenarios: list[ListedScenario]


class Written(_Open):
    """What `rx90 recipe --json` and `rx90 view --render FILE --json` print."""

    out: str = Field(description="the file that was written")


class Converted(_Open):
    """What `rx90 convert --json` prints."""

    out: str
    layout: str | None = Field(description="of logs that are recognised or named, null where their columns are said")
    signal: str | None = Field(description="what v was said to be")
    v: str | None = Field(description="what v of the recording is")
    samples: int
    joints: int
    duration_s: float
    rate_hz: float
    columns: dict[str, str | list[str]] = Field(description="of the log, that were taken for t, q and v")
    notes: list[str]


class Sampled(_Open):
    """What `rx90 trajectory --json` prints; a number a joint."""

    out: str
    format: str
    samples: int
    duration_s: float
    start: list[float] = Field(description="[rad or m]")
    max_velocity: list[float] = Field(description="[rad/s or m/s]")
    max_acceleration: list[float] = Field(description="[rad/s^2 or m/s^2]")
    beyond_limits: list[str]


class Searched(_Open):
    """What `rx90 excite --json` prints."""

    out: str
    tried: int = Field(description="motions")
    cost_of_start: float
    cost: float
    predicted_rel_std: list[float | None] = Field(description="of each gain, null where the motion does not show it")


class NewRobot(_Open):
    """What `rx90 new-robot --json` prints."""

    robot: str
    joints: list[str]
    predicted_rel_std: list[float]
    identifiable: list[bool]
    files: list[str]


class Deviations(_Open):
    """A number and what its deviation is made of; null where the data do not show it."""

    estimate: float | None = None
    std: float | None = Field(description="one standard deviation, of all parts together")
    residual_std: float | None
    gain_std: float | None
    model_std: float | None


class Quantity(Deviations):
    """Mass, a coordinate of the centre, or an inertia about it."""

    quantity: str
    unit: str


class Weighed(Deviations):
    """A known mass as all joints (joint null) or one joint weighs it [kg]."""

    joint: int | None
    mass: float | None = Field(description="[kg]")
    rel_error: float | None
    rel_std: float | None
    verdict: str
    reason: str | None


class Verification(_Open):
    """What `rx90 verify --gains G --json` prints."""

    passed: bool
    mass: float = Field(description="on the scale [kg]")
    mass_std: float = Field(description="[kg]")
    limit: float = Field(description="standard deviations beyond which a mass is another")
    together: Weighed
    joints: list[Weighed]
    payload: list[Quantity]
    notes: list[str]


class PredictedJoint(_Open):
    """How well a joint's currents are predicted from other parts of the motions."""

    joint: int = Field(ge=1)
    name: str
    predicted_rel_error: float
    fitted_rel_error: float
    gain_changes: list[float]


class CrossValidation(_Open):
    """What `rx90 verify --json` prints without gains."""

    method: str
    joints: list[PredictedJoint]


class PayloadParameter(Deviations):
    """A standard parameter at the origin of the last frame."""

    parameter: str
    unit: str


class FoundPayload(_Open):
    """What `rx90 payload-of --json` prints."""

    parameters: list[PayloadParameter]
    covariance: list[list[float]]
    body: list[Quantity]
    refused: dict[str, str] = Field(description="reasons")
    possible: bool | None = Field(description="whether a body can have these parameters")
    notes: list[str]


class Torques(_Open):
    """What `rx90 torque --json` prints."""

    out: str
    samples: int
    joints: list[int] = Field(description="that have columns")
    missing: list[dict[str, int | str]] = Field(description="joints that have none, with the reason")


class Patched(_Open):
    """What `rx90 patch --json` prints."""

    out: str
    ros_params: str | None
    changes: list[Change]


class Moved(_Open):
    """A gain that may have changed, by its logarithm."""

    rel_change: float
    std: float
    turned: bool = Field(description="whether its sign is another")
    moved: bool = Field(description="whether it changed beyond its interval")


class MovedJoint(Moved):
    """A joint's gain; `apart`: once a scale common to all joints is taken out."""

    joint: int = Field(ge=1)
    apart: Moved


class ChiSquare(_Open):
    """A test of all joints together."""

    chi2: float
    freedom: int
    p: float


class GainComparison(_Open):
    """What `rx90 compare-gains --json` prints."""

    moved: bool
    joints: list[MovedJoint]
    scale: Moved
    together: ChiSquare
    pattern: ChiSquare | None
    missing: list[dict[str, int | str]] = Field(description="joints that one of both has")


class Cost(_Open):
    """What an error source costs a gain, as shares of it."""

    source: str
    bias: float
    std: float
    rms: float


class PredictedBudgetJoint(_Open):
    """A joint's budget."""

    joint: int = Field(ge=1)
    costs: list[Cost]
    together: Cost
    tolerance: float
    within: float = Field(description="probability that the error is within the tolerance")


class PredictedBudget(_Open):
    """What `rx90 predict --json` prints."""

    scenario: str
    method: str
    remarks: list[str]
    joints: list[PredictedBudgetJoint]
    refused: list[dict[str, int | str]]
    unpredicted: list[dict[str, str]]


class StudyResult(_Open):
    """What `rx90 monte-carlo --json` prints."""

    scenario: str
    seed: int
    trials: int
    passed: bool
    joints: list[JointStatistics]
    failures: dict[str, int] = Field(description="trials without any estimate, by kind")


class BudgetJoint(_Open):
    """What a joint's gain errs by, as shares of it."""

    joint: int = Field(ge=1)
    costs: list[SourceCost]
    floor: float | None
    together: float | None
    samples: int
    lost: int
    summed: float
    silent: list[str] = Field(description="sources none of whose own trials gave the joint a gain")


class Budget(_Open):
    """What `rx90 sensitivity --json` prints."""

    scenario: str
    trials: int
    joints: list[BudgetJoint]


class ComparedScenario(_Open):
    """How methods did on a scenario."""

    name: str
    trials: int
    unposed: int
    methods: list[MethodSummary]


class Comparison(_Open):
    """What `rx90 compare --json` prints of scenarios, and with --open of sealed problems."""

    about: dict[str, str]
    scenarios: list[ComparedScenario]


class Answers(_Open):
    """What `rx90 compare --json` prints of problem folders."""

    answers: list[AnswerRow]


class KeptPromise(_Open):
    """A promise that any method should keep."""

    promise: str
    broken: str | None = Field(description="how, null if it is kept")
    kept: bool


class Contract(_Open):
    """What `rx90 compare --check M --json` prints."""

    method: str
    passed: bool
    checks: list[KeptPromise]


class SealedProblems(_Open):
    """What `rx90 compare --seal DIR --json` prints."""

    problems: int
    folder: str


class Claim(_Open):
    """A claim of the paper."""

    claim: str
    holds: bool


class PaperResult(_Open):
    """What `rx90 paper --json` prints."""

    cases: list[dict[str, object]]
    second_payload: dict[str, object]
    checks: list[Claim]
    passed: bool


class DesignedJoint(_Open):
    """What a joint sees of a payload."""

    joint: int = Field(ge=1)
    wanted: bool
    payload_torque_rms: float = Field(description="[N m]")
    std: float | None = Field(description="predicted, as a share of the gain")
    payload_std: float | None
    shown: bool


class DesignedPayload(_Open):
    """A payload and what the joints see of it."""

    payload: dict[str, object]
    joints: list[DesignedJoint]


class PayloadDesign(_Open):
    """What `rx90 payload --json` prints."""

    scenario: str
    residual: float
    rated_load: float = Field(description="[kg]")
    flange: str | None
    before: DesignedPayload
    after: DesignedPayload
    candidates: list[DesignedPayload]


class BareParameter(_Open):
    """A parameter that bare motions show."""

    parameter: str
    unit: str
    estimate: float
    std: float


class BareJoint(_Open):
    """A joint's gain over that of the reference joint, and its friction in drive units."""

    joint: int = Field(ge=1)
    name: str
    ratio: float | None
    rel_std: float | None
    off: float | None = Field(description="share by which given gains contradict the ratio")
    off_std: float | None
    friction: list[BareParameter]


class ExpectedJoint(_Open):
    """What a payload would make of a joint's gain."""

    joint: int = Field(ge=1)
    rel_std: float | None = Field(description="standard deviation to expect as a share of the gain, null if refused")
    reason: str | None = Field(description="why there is none")


class ExpectedGains(_Open):
    """What to expect of the gains if the same motions were repeated with a payload."""

    mass: float = Field(description="of the payload [kg]")
    joints: list[ExpectedJoint]


class BareResult(_Open):
    """What `rx90 identify --json` prints of bare recordings alone."""

    reference: int = Field(ge=1)
    joints: list[BareJoint]
    base_parameters: list[BareParameter]
    base_parameters_si: list[BareParameter] | None
    if_loaded: ExpectedGains | None = Field(description="null unless --if-loaded asks")
    consistent: Links | None = Field(description="null without --gains, or if the model has no bodies")
    consistent_reason: str | None
    notes: list[str]


RESULTS: dict[str, type[BaseModel]] = {
    "list": ListedScenarios,
    "written": Written,
    "convert": Converted,
    "trajectory": Sampled,
    "excite": Searched,
    "new-robot": NewRobot,
    "payload-design": PayloadDesign,
    "identify-bare": BareResult,
    "verify": Verification,
    "verify-motions": CrossValidation,
    "payload-of": FoundPayload,
    "torque": Torques,
    "patch": Patched,
    "compare-gains": GainComparison,
    "predict": PredictedBudget,
    "monte-carlo": StudyResult,
    "sensitivity": Budget,
    "compare": Comparison,
    "compare-answers": Answers,
    "compare-check": Contract,
    "compare-seal": SealedProblems,
    "paper": PaperResult,
}
"""Models of results by the name of their schema."""
