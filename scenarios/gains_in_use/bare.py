"""Results of bare recordings: ratios of gains, parameters of the arm, expected gains with a payload."""

from collections.abc import Sequence

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.plausibility import prediction_warnings
from ident.estimation.cross_validation import predicted
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.parameters.arm import BareArm, arm_in_SI, forecast_gains, gain_ratios
from ident.parameters.links import nearest_links
from ident.payload.payload import Payload
from ident.preparation import Policy, joined, prepare, raise_for
from ident.recordings.recording import Motion
from ident.support.errors import RobotModelError
from scenarios.experiments.robots import KINEMATICS_ONLY, NamedRobot, is_placeholder, nominal_links
from scenarios.results.bare import BareJoint, BareParameter, BareResult, ExpectedGains, ExpectedJoint, Links
from scenarios.results.diagnoses import diagnosed_values
from sim.errors import PlantError

NO_GAINS = "without gains the parameters are not in SI units (--gains)"


def bare_result(
    motions: Sequence[Motion],
    robot: NamedRobot,
    *,
    observing: ObserveOptions,
    gains: GainOptions,
    options: AllJointsOptions,
    known: KnownGains | None,
    payload: Payload | None,
    policy: Policy,
) -> tuple[BareResult, ObserveOptions]:
    """Return the results of motions with a bare flange, and the filters with the compensated delay.

    With `known` gains, parameters are also in SI; with a planned `payload` too, the gains that it would give.

    Raises:
        IdentificationError: If the recordings are not of this arm, differ in the scale of currents, or determine no
            ratio; if the gains are not of this arm; if no parameter of the payload is known.
    """
    prepared = prepare(motions, robot.structure, observing=observing, gains=gains, policy=policy)
    diagnosed = diagnose(prepared.logs())
    raise_for(prepared, diagnosed)
    found = gain_ratios(prepared.problem, options)
    ratios, arm, expected = found.ratios, robot.structure.arm, None
    assert ratios is not None, "ratios were asked for"
    in_si = None if known is None else arm_in_SI(prepared.problem, options, known)
    if in_si is not None and payload is not None:
        forecast = forecast_gains(prepared.problem, options, payload, in_si, ratios)
        joints = [
            ExpectedJoint(joint=j, rel_std=None, reason=each)
            if isinstance(each, str)
            else ExpectedJoint(joint=j, rel_std=each, reason=None)
            for j, each in enumerate(forecast, 1)
        ]
        expected = ExpectedGains(mass=payload.mass, joints=joints)
    gain = {} if known is None else dict(zip(known.joints.tolist(), known.value.tolist(), strict=True))
    off = {} if known is None else ratios.against(known)
    share = {each.joint: each for each in predicted(found.selected.final.rows)}
    links = consistent_links(in_si, robot)
    result = BareResult(
        reference=ratios.reference + 1,
        joints=[
            BareJoint(
                joint=j + 1,
                name=arm.joint_names[j],
                ratio=float(ratios.value[j]) if ratios.given[j] else None,
                rel_std=float(ratios.rel_std[j]) if ratios.given[j] else None,
                predicted_rel_std=float(ratios.rel_std[j]),
                reason=ratios.reason(j),
                gain=gain.get(j),
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
        if_loaded=expected,
        consistent=None if isinstance(links, str) else links,
        consistent_reason=links if isinstance(links, str) else None,
        notes=[*prediction_warnings({j: each.share for j, each in share.items()}), *found.selected.remarks],
        **diagnosed_values(joined(diagnosed, more=prepared.diagnoses)),
    )
    return result, prepared.observing


def consistent_links(in_si: BareArm | None, robot: NamedRobot) -> Links | str:
    """Return the physically consistent links nearest to the model's, or why there are none."""
    if in_si is None:
        return NO_GAINS
    try:
        nominal = nominal_links(robot.model, robot.flange)
        if is_placeholder(nominal):
            return KINEMATICS_ONLY
        found = nearest_links(robot.structure.base, in_si.inertial, in_si.inertial_covariance, nominal)
    except (PlantError, RobotModelError) as error:
        return str(error)
    return Links.of(found, nominal, robot.structure.arm)
