"""Estimates with given gains: payloads, the arm from bare motions, torques; recordings that suit a file of gains."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from pydantic import Field, JsonValue

from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.gain_checks import OTHER_UNIT
from ident.diagnosis.plausibility import prediction_warnings
from ident.estimation.estimators import nls
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.intervals import cross_validated
from ident.estimation.known_gains import JointTorque, KnownGains
from ident.estimation.problem import GainOptions
from ident.identification import doubts, estimate_by
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.parameters.arm import PLAIN, BareArm, arm_in_SI, gain_ratios
from ident.parameters.links import nearest_links
from ident.parameters.payload import FoundPayload, payload_of
from ident.parameters.weighing import ANY_MASS, UNKNOWN, Verification, as_stated, verified
from ident.payload.payload import Payload
from ident.preparation import Policy, Prepared, prepare, raise_for
from ident.recordings.recording import Motion, Recording, has_marks
from ident.support.errors import IdentificationError, OptionError, RobotModelError
from ident.support.naming import one_line
from ident.support.options import options_from_table
from scenarios.experiments.robots import KINEMATICS_ONLY, NamedRobot, is_placeholder, nominal_links
from scenarios.rendering.content import Paragraph, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import plus_minus, rounded, sentence, two_sigma
from scenarios.results.bare import BareJoint, BareParameter, BareResult, Links
from scenarios.results.gains_file import GainsFile, recording_digest
from scenarios.results.problem_folder import GivenProblem
from scenarios.support.errors import ScenarioError
from sim.errors import PlantError

Options = TypeVar("Options")
GIVEN = ("gain_joint", "gain_value", "gain_laws")
"""Options that define or correct the gains; not applicable with given gains."""
SWAPPED = "given as bare, but it was loaded when the gains were identified ({}); are bare and loaded swapped?"
REPRODUCED = (
    "the gains were identified from this recording or a copy or part of it ({}), so they reproduce the payload that "
    "was specified then; use a recording with another payload"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Weighing:
    """A payload estimated with given gains."""

    payload: FoundPayload  # the estimate
    # Its mass compared with the weighed one or, without a scale, the joints' with that of all; None if that is not
    # significant:
    verified: Verification | None
    found: Diagnosed  # diagnoses of the recordings
    prepared: Prepared  # the recordings as used


def weighing(
    structure: Structure,
    unloaded: Sequence[Recording],
    loaded: Sequence[Recording],
    file: GainsFile,
    *,
    weighed: Payload | None,
    delay: float | None,
    policy: Policy,
) -> Weighing:
    """Estimate the payload of a mounting, None if not `weighed`, with the gains of a file and their options.

    A `delay` of the currents replaces that of the file. Recordings are diagnosed with the gains that they give, not
    with those of the file. Raises `IdentificationError` if recordings are not of this arm or have a fault, or the
    payload is not identifiable, `ScenarioError` if options are not valid, or a recording was used for the gains.
    """
    known = file.of(structure.arm)
    check_unseen(file, unloaded, loaded)
    stated = file.options.observe if delay is None else {**file.options.observe, "current_delay": delay}
    observing, limits = options_of(ObserveOptions, stated), options_of(GainOptions, file.options.gains)
    options = model_options(file)
    motions = [Motion(each) for each in unloaded] + [Motion(each, weighed or UNKNOWN) for each in loaded]

    def ready(motions: Sequence[Motion]) -> Prepared:
        return prepare(motions, structure, observing=observing, gains=limits, policy=policy)

    prepared = ready(motions)
    raise_for(prepared.diagnoses)
    try:
        found = payload_of(prepared.carrying(UNKNOWN).problem, known, options)
        found.body.check_mass()
    except IdentificationError:  # a fault of the recordings is reported as the cause
        raise_for(doubts(prepared).found.diagnoses)
        raise
    payload = weighed or as_stated(found.body)
    constant = prepared if not known.curves else ready([_of_constant_gains(each, known) for each in motions])
    doubted = doubts(constant.carrying(payload or ANY_MASS), estimate_by(nls.NAME, options), needed=False)
    raise_for(doubted.found.diagnoses)
    shown = doubted.estimate or str(doubted.failed)
    return Weighing(
        payload=found,
        verified=None if payload is None else verified(found, payload, known, shown),
        found=doubted.found,
        prepared=prepared,
    )


def _of_constant_gains(motion: Motion, gains: KnownGains) -> Motion:
    """Return a motion with the currents that have the same torques with the constant part of gains."""
    v = motion.recording.v
    v = v * gains.relative(v, np.broadcast_to(np.arange(v.shape[1]), v.shape))
    return replace(motion, recording=replace(motion.recording, v=v))


def bare_result(
    given: GivenProblem, robot: NamedRobot, known: KnownGains | None, policy: Policy
) -> tuple[BareResult, ObserveOptions]:
    """Return the results of motions with a bare flange by `nls`, and the filters with the compensated delay.

    With `known` gains, parameters are also in SI. Raises `IdentificationError` if the recordings are not of this arm,
    differ in the scale of currents, or determine no ratio; if the gains are not of this arm.
    """
    options = given.options
    assert isinstance(options, AllJointsOptions), "of the only method for bare motions"
    prepared = prepare(given.motions, robot.structure, observing=given.observing, gains=given.gains, policy=policy)
    diagnosed = doubts(prepared).found
    raise_for(diagnosed.diagnoses)
    found = gain_ratios(prepared.problem, options, known)
    ratios, arm = found.ratios, robot.structure.arm
    assert ratios is not None, "ratios were asked for"
    in_si = None if known is None else arm_in_SI(prepared.problem, options, known)
    gain, off = ({}, {}) if known is None else (known.by_joint, ratios.against(known))
    share = {each.joint: each for each in cross_validated(found.selected.final.rows)}
    links, why = consistent_links(in_si, robot)

    def joint(j: int) -> BareJoint:
        rel_std, given, parts = float(ratios.rel_std[j]), ratios.given[j], share.get(j)
        return BareJoint(
            joint=j + 1,
            name=arm.joint_names[j],
            ratio=float(ratios.value[j]) if given else None,
            rel_std=rel_std if given else None,
            predicted_rel_std=rel_std,
            reason=ratios.reason(j),
            gain=gain.get(j),
            off=off[j][0] if j in off else None,
            off_std=off[j][1] if j in off else None,
            predicted_rel_error=parts and parts.share,
            fitted_rel_error=parts and parts.fitted,
            friction=list(map(BareParameter.model_validate, found.friction[j])),
        )

    result = BareResult(
        reference=ratios.reference + 1,
        joints=list(map(joint, range(arm.n))),
        base_parameters=list(map(BareParameter.model_validate, found.inertial)),
        base_parameters_si=None if in_si is None else list(map(BareParameter.model_validate, in_si.inertial)),
        consistent=links,
        consistent_reason=why,
        notes=[*prediction_warnings({j: each.share for j, each in share.items()}), *found.selected.remarks],
        **BareResult.values_of(diagnosed),
    )
    return result, prepared.observing


def consistent_links(in_si: BareArm | None, robot: NamedRobot) -> tuple[Links | None, str | None]:
    """Return the physically consistent links nearest to the model's, or why there are none."""
    if in_si is None:
        return None, "without gains the parameters are not in SI units (--gains)"
    try:
        nominal = nominal_links(robot.model, robot.flange)
        if is_placeholder(nominal):
            return None, KINEMATICS_ONLY
        found = nearest_links(robot.structure.base, in_si.inertial, in_si.inertial_covariance, nominal)
    except (PlantError, RobotModelError) as error:
        return None, str(error)
    return Links.of(found, nominal, robot.structure.arm), None


def model_options(file: GainsFile) -> AllJointsOptions:
    """Return the model options of a gains file; `PLAIN` for methods other than nls."""
    if file.method not in (None, nls.NAME):
        return PLAIN
    return options_of(AllJointsOptions, {name: x for name, x in file.options.method.items() if name not in GIVEN})


def options_of(kind: type[Options], stated: Mapping[str, JsonValue]) -> Options:
    """Return options of a gains file."""
    try:
        return options_from_table(kind, stated)
    except OptionError as error:
        raise ScenarioError(f"gains file: options: {error}") from error


def check_unseen(file: GainsFile, unloaded: Sequence[Recording], loaded: Sequence[Recording]) -> None:
    """Refuse a loaded motion that was used for the gains, whose mass it would reproduce, and a bare one loaded then."""
    carried = [each for each in file.recordings if each.payload is not None]
    for recordings, entries, words in ((unloaded, carried, SWAPPED), (loaded, file.recordings, REPRODUCED)):
        for recording in recordings:
            digest = recording_digest(recording)
            seen = next((x.name for x in entries if x.sha256 == digest or has_marks(recording, x.marks)), None)
            if seen is not None:
                raise ScenarioError(f"{one_line(recording.name)}: {words.format(seen)}")


def check_currents(file: GainsFile, recording: Recording) -> tuple[str, ...]:
    """Return a remark if currents are larger than any with which gains are known.

    Refuses currents in a smaller unit than those of the gains, of all joints larger by more than a factor of units;
    those in a larger unit look like the currents of an arm at rest.
    """
    before = file.largest_currents
    if len(before) != recording.n:
        return ()
    now = np.abs(recording.v).max(axis=0)
    if before.all() and (now > OTHER_UNIT * before).all():
        j = int(np.argmin(now / before))
        raise ScenarioError(
            f"{one_line(recording.name)}: v{j + 1} reaches {now[j]:.3g}, but {before[j]:.3g} when the gains were "
            "identified, and likewise all joints; are the currents in another unit? --columns states it, as in 'v=[mA]'"
        )
    beyond = [entry.identifiable and now[j] > before[j] for j, entry in enumerate(file.gains)]
    words = [f"v{j + 1} reaches {now[j]:.3g}, known up to {before[j]:.3g}" for j in np.flatnonzero(beyond)]
    return (f"{'; '.join(words)}: at larger currents a gain may differ",) if words else ()


OF_MOTORS = "torques are those of the motors; those of the joints are A' times these, A the transmission of the gains"


class TorqueJoint(ResultModel):
    """Torque of a joint, or force if it slides."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    name: str  # name of the joint, empty if the gains have none
    unit: str  # unit of the values
    rms: float  # root mean square, in `unit`
    peak: float  # largest magnitude, in `unit`
    peak_std: float  # standard deviation of the peak from that of the gain, in `unit`

    @property
    def precision(self) -> float:
        """Uncertainty that determines the digits: four of them without a standard deviation."""
        return 2.0 * self.peak_std or 0.01 * self.peak


class Torques(ResultModel):
    """What `rx90 torque --json` prints."""

    out: str  # the written file
    samples: int  # number of samples, and of rows of the file
    missing: list[dict[str, int | str]]  # joints without columns, with the reason
    notes: list[str]  # remarks on gains and currents
    robot: str | None = None  # robot of the gains, null if unknown
    torques: list[TorqueJoint]  # torques of the joints that have columns

    @classmethod
    def of(cls, found: JointTorque, file: GainsFile, out: Path, remarks: Sequence[str] = ()) -> "Torques":
        """Return the result of written torques, with remarks on the currents."""
        peaks = np.argmax(np.abs(found.tau), axis=0)
        return cls(
            out=str(out),
            samples=len(found.t),
            missing=[
                {"joint": entry.joint, "reason": one_line(entry.reason or "its gain is refused")}
                for entry in file.gains
                if not entry.identifiable
            ],
            notes=[*file.notes, *remarks, *([OF_MOTORS] if file.transmission else ())],
            robot=file.robot,
            torques=[
                TorqueJoint(
                    joint=joint + 1,
                    name=str(file.gains[joint].name or ""),
                    unit=file.gains[joint].torque_unit,
                    rms=float(np.sqrt(np.mean(found.tau[:, k] ** 2))),
                    peak=float(abs(found.tau[at, k])),
                    peak_std=float(found.std[at, k]),
                )
                for k, (joint, at) in enumerate(zip(found.joints.tolist(), peaks.tolist(), strict=True))
            ],
        )

    def parts(self) -> Iterable[Part]:
        """Largest torques, and what they include."""
        largest = list[str]()
        for unit in dict.fromkeys(each.unit for each in self.torques):
            most = max((each for each in self.torques if each.unit == unit), key=lambda each: each.peak)
            largest.append(f"{plus_minus(most.peak, 2.0 * most.peak_std)} {unit} on joint {most.joint}")
        sure = not any(each.peak_std for each in self.torques)
        yield Paragraph(f"Peak {' and '.join(largest)}{'' if sure else ' (2 sigma)'}.", strong=True)
        yield table(
            self.torques,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: each.name, words=True),
            column("Rms", lambda each: rounded(each.rms, each.precision)),
            column("Peak", lambda each: rounded(each.peak, each.precision)),
            column("2 sigma", lambda each: rounded(2.0 * each.peak_std or None, each.precision)),
            column("Unit", lambda each: each.unit, words=True),
            column("2 sigma [%]", lambda each: two_sigma(each.peak_std / each.peak if each.peak_std else None)),
        )
        yield Paragraph(
            "Torque of the drive, current times gain. It includes friction and the amplifier's offset, which currents "
            "alone do not separate from the torque of the links. 2 sigma: of the gain, and of the torque at its peak."
        )
        if self.robot is not None:
            yield Paragraph(
                f"The gains are of robot {one_line(self.robot)}. Logs do not name their robot: make sure that this log "
                "is of the same one."
            )
        for each in self.missing:
            yield Paragraph(sentence(f"Joint {each['joint']} has no column: {each['reason']}"))
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes)
