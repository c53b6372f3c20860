"""Results of bare recordings: ratios of gains, parameters of the arm, expected gains with a payload."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.plausibility import prediction_warnings
from ident.estimation.cross_validation import predicted
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_options import GainOptions
from ident.estimation.known_gains import KnownGains
from ident.model.arm import Arm
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.parameters.arm import BareArm, arm_in_SI, forecast_gains, gain_ratios
from ident.payload.payload import Payload
from ident.preparation import DOUBTED, Policy, joined, prepare, raise_for
from ident.recordings.recording import Motion
from scenarios.gains_in_use.model_values import Unknown
from scenarios.results.bare import BareJoint, BareParameter, BareResult, ExpectedGains, ExpectedJoint
from scenarios.results.diagnoses import diagnosed_values
from scenarios.results.links import Links


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BareAnswer:
    """Results of bare recordings.

    Attributes:
        found: The arm over the gain of a reference joint, with ratios.
        in_si: The arm in SI units with given gains, None without gains.
        if_loaded: Expected gains with a payload, None if not requested.
        said: Diagnoses of the recordings.
        observing: Filters and thresholds, with the compensated delay.
    """

    found: BareArm
    in_si: BareArm | None
    if_loaded: ExpectedGains | None
    said: Diagnosed
    observing: ObserveOptions


def bare_answer(
    motions: Sequence[Motion],
    structure: Structure,
    *,
    observing: ObserveOptions,
    gains: GainOptions,
    options: AllJointsOptions,
    known: KnownGains | None,
    payload: Payload | None,
    policy: Policy = DOUBTED,
) -> BareAnswer:
    """Results of bare recordings.

    Args:
        motions: Motions with a bare flange.
        structure: Identifiable structure of the arm.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain.
        options: Model of the arm.
        known: Known or a-priori gains.
        payload: A planned payload; needs `known`.
        policy: Policy for checks and repairs of the recordings.

    Raises:
        IdentificationError: If the recordings are not of this arm, differ in the scale of currents, or determine no
            ratio; if the gains are not of this arm; if no parameter of the payload is known.
    """
    prepared = prepare(motions, structure, observing=observing, gains=gains, policy=policy)
    said = diagnose(prepared.logs())
    raise_for(prepared, said)
    found = gain_ratios(prepared.problem, options)
    assert found.ratios is not None, "ratios were asked for"
    in_si, if_loaded = None if known is None else arm_in_SI(prepared.problem, options, known), None
    if in_si is not None and payload is not None:
        expected = enumerate(forecast_gains(prepared.problem, options, payload, in_si, found.ratios), 1)
        joints = [
            ExpectedJoint(joint=j, rel_std=None, reason=each)
            if isinstance(each, str)
            else ExpectedJoint(joint=j, rel_std=each, reason=None)
            for j, each in expected
        ]
        if_loaded = ExpectedGains(mass=payload.mass, joints=joints)
    said = joined(said, more=prepared.diagnoses)
    return BareAnswer(found=found, in_si=in_si, if_loaded=if_loaded, said=said, observing=prepared.observing)


def bare_result(answer: BareAnswer, links: Links | Unknown, arm: Arm) -> BareResult:
    """Return the results of bare recordings as printed by `rx90 identify --json`.

    Args:
        answer: The results.
        links: Physically consistent links, or why there are none.
        arm: The arm.
    """
    found, in_si, ratios = answer.found, answer.in_si, answer.found.ratios
    assert ratios is not None, "ratios were asked for"
    known = None if in_si is None else in_si.gains
    given = {} if known is None else dict(zip(known.joints.tolist(), known.value.tolist(), strict=True))
    off = {} if known is None else ratios.against(known)
    share = {each.joint: each for each in predicted(found.selected.final.fit.rows)}
    return BareResult(
        reference=ratios.reference + 1,
        joints=[
            BareJoint(
                joint=j + 1,
                name=arm.joint_names[j],
                ratio=float(ratios.value[j]) if ratios.given[j] else None,
                rel_std=float(ratios.rel_std[j]) if ratios.given[j] else None,
                predicted_rel_std=float(ratios.rel_std[j]),
                reason=ratios.reason(j),
                gain=given.get(j),
                off=off.get(j, (None, None))[0],
                off_std=off.get(j, (None, None))[1],
                predicted_rel_error=share[j].share if j in share else None,
                fitted_rel_error=share[j].fitted if j in share else None,
                friction=[BareParameter.of(each) for each in found.friction[j]],
            )
            for j in range(arm.n)
        ],
        base_parameters=[BareParameter.of(each) for each in found.inertial],
        base_parameters_si=None if in_si is None else [BareParameter.of(each) for each in in_si.inertial],
        if_loaded=answer.if_loaded,
        consistent=None if isinstance(links, Unknown) else links,
        consistent_reason=links.reason if isinstance(links, Unknown) else None,
        notes=[*prediction_warnings({j: each.share for j, each in share.items()}), *found.selected.remarks],
        **diagnosed_values(answer.said),
    )
