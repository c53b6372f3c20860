"""Identified values of a model file in SI, or why there are none: scale of efforts, friction, armature, links.

Friction, base parameters and links are from the output of `rx90 identify --json` for bare motions. Base parameter k of
the arm, in units of the reference joint's current, times the gain of that joint is in SI; friction is in units of the
joint's own current. Of rotor inertia Ia, only an `Ia` that is a base parameter by itself is written.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.diagnosis.alternative import two_digits
from ident.model.arm import Arm
from ident.model.structure import Structure
from ident.parameters.arm import BareArm
from ident.parameters.links import ModelLinks, nearest_links
from ident.support.arrays import Array
from ident.support.errors import NoBody
from ident.support.files import LARGEST, read_bytes
from ident.support.naming import one_line
from scenarios.experiments.gains_file import GainEntry, GainsFile
from scenarios.experiments.robots import KINEMATICS_ONLY, is_placeholder, nominal_links
from scenarios.results.links import FAR, Link, Links, links_document, same_frames
from scenarios.support.errors import ScenarioError
from sim.errors import ModelFileError

NO_NOMINAL = "no data-sheet gains are given (--nominal)"
NO_BARE = "no identification of bare motions is given (--arm)"
NO_GAINS = "without gains the parameters are not in SI units (--gains)"
SAME = 1e-6
"""Largest difference due to rounding in a file: of frames, in metres or of unit vectors, and of gains, relative."""


class _Part(BaseModel):
    """Required keys; further keys are allowed."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Found(_Part):
    """A parameter."""

    parameter: str
    estimate: float
    std: float = Field(ge=0.0)


class JointPart(_Part):
    """A joint.

    Attributes:
        gain: Gain used for base parameters in SI and links, None if none was given.
        predicted_rel_error: Error of the cross-validation, relative to the currents.
        fitted_rel_error: Residual of the fit, relative to the currents.
    """

    joint: int
    name: str
    friction: tuple[Found, ...]
    gain: float | None = None
    predicted_rel_error: float | None = None
    fitted_rel_error: float | None = None


class BareFile(_Part):
    """The arm identified from bare motions.

    Attributes:
        reference: Reference joint, from 1.
        joints: Joints, in order.
        base_parameters: Base parameters over the gain of the reference joint.
        consistent: Physically consistent links, None if there are none.
        consistent_reason: Why there are none.
    """

    reference: int = Field(ge=1)
    joints: tuple[JointPart, ...] = Field(min_length=1)
    base_parameters: tuple[Found, ...]
    consistent: Links | None = None
    consistent_reason: str | None = None


def read_bare(path: Path) -> BareFile:
    """Read the results of bare motions.

    Raises:
        ScenarioError: If the file is missing or not such a result; one line.
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


@dataclass(frozen=True, slots=True)
class Value:
    """A positive number, joint side, in SI; a scale of efforts is dimensionless.

    Attributes:
        value: The number.
        rel_std: Its relative standard deviation, including that of the gain.
    """

    value: float
    rel_std: float


@dataclass(frozen=True, slots=True)
class Unknown:
    """The reason why there is no number."""

    reason: str


Known = Value | Unknown


@dataclass(frozen=True, slots=True, kw_only=True)
class JointValues:
    """A joint.

    Attributes:
        name: Name in the model.
        effort: Ratio of identified to data-sheet gain, without sign.
        damping: Viscous friction [N m s/rad or N s/m].
        friction: Coulomb friction [N m or N].
        armature: Inertia of rotor and gear, joint side [kg m^2 or kg]; None if it is written with the links.
    """

    name: str
    effort: Known
    damping: Known
    friction: Known
    armature: Known | None


def joint_values(
    structure: Structure, gains: GainsFile, nominal: GainsFile | None, bare: BareFile | None, *, most: float
) -> tuple[JointValues, ...]:
    """Return the identified values of every joint.

    Args:
        structure: Identifiable structure of the arm.
        gains: Identified gains.
        nominal: Data-sheet gains on which the efforts in the model are based.
        bare: Friction and base parameters.
        most: Largest relative standard deviation of a number that is used.

    Raises:
        GainsError: If gains are not of this arm.
        ScenarioError: If `bare` is not.
    """
    for file in (gains, nominal):
        if file is not None:
            file.of(structure.arm)
    names = structure.arm.joint_names
    if bare is not None and tuple(each.name for each in bare.joints) != names:
        found = ", ".join(each.name for each in bare.joints)
        raise ScenarioError(f"bare motions of joints {found}; robot {structure.arm.name} has {', '.join(names)}")
    if bare is not None and bare.reference > len(names):
        raise ScenarioError(f"reference = {bare.reference}: robot {structure.arm.name} has {len(names)} joints")
    unit = None if bare is None else _gain(gains.gains[bare.reference - 1])
    return tuple(
        JointValues(
            name=name,
            effort=_effort(gains.gains[j], None if nominal is None else nominal.gains[j], most),
            damping=_friction(gains.gains[j], bare, j, "Fv", most),
            friction=_friction(gains.gains[j], bare, j, "Fc", most),
            armature=Unknown(NO_BARE) if bare is None or unit is None else _armature(structure, unit, bare, j, most),
        )
        for j, name in enumerate(names)
    )


def _gain(entry: GainEntry) -> Known:
    """Return a gain with its sign, or why there is none."""
    if entry.estimate is None or entry.std is None:
        return Unknown(f"the gain of joint {entry.joint} is refused")
    return Value(entry.estimate, abs(entry.std / entry.estimate))


def _effort(entry: GainEntry, nominal: GainEntry | None, most: float) -> Known:
    if nominal is None:
        return Unknown(NO_NOMINAL)
    gain, old = _gain(entry), _gain(nominal)
    if isinstance(gain, Unknown):
        return gain
    if isinstance(old, Unknown):
        return Unknown(f"the data sheet has no gain of joint {entry.joint}")
    return _sure(abs(gain.value / old.value), gain.rel_std, most)


def _friction(entry: GainEntry, bare: BareFile | None, j: int, name: str, most: float) -> Known:
    """Return friction times gain, for the law `v = Fv dq + Fc sign(dq) + off` [drive units]."""
    if bare is None:
        return Unknown(NO_BARE)
    gain, own = _gain(entry), {each.parameter: each for each in bare.joints[j].friction}
    if isinstance(gain, Unknown):
        return gain
    curved = [each for each in own if each.startswith(("cbrt", "by-direction"))]
    if curved and name == "Fv":
        return Unknown(f"viscous friction is not linear in speed ({', '.join(curved)})")
    if name in own:
        return _times(own[name], gain, most)
    if any(each.startswith(f"{name} in motion") for each in own):
        return Unknown("differs between motions; identify one, or --option friction_per_motion=false")
    return Unknown("not identified")


def _armature(structure: Structure, unit: Known, bare: BareFile, j: int, most: float) -> Known:
    """Return Ia if it is a base parameter, not regrouped with the inertia of links."""
    name = f"Ia{j + 1}"
    if set(structure.base.groups().get(name, {})) != {name}:
        return Unknown("regrouped with link inertia: only their sum is identifiable")
    found = next((each for each in bare.base_parameters if each.parameter == name), None)
    if found is None:
        return Unknown("not identifiable from these motions")
    return unit if isinstance(unit, Unknown) else _times(found, unit, most)


def _times(found: Found, gain: Value, most: float) -> Known:
    """Return a parameter in SI from drive units; an estimate of 0 has no relative standard deviation."""
    value = found.estimate * gain.value
    if value <= 0.0:
        return Unknown(f"identified as {value:.3g}, not positive")
    return _sure(value, float((found.std**2 / found.estimate**2 + gain.rel_std**2) ** 0.5), most)


def _sure(value: float, rel_std: float, most: float) -> Known:
    if rel_std > most:
        found, limit = two_digits(100.0 * rel_std), f"{100.0 * most:g} %"
        return Unknown(f"identified as {value:.3g}, with a standard deviation of {found} %, more than {limit}")
    return Value(value, rel_std)


def unstated_parameters(
    structure: Structure, gains: GainsFile, bare: BareFile | None, stated: Array, motor: Array
) -> tuple[Array, Array]:
    """Return what bare motions show and a model does not state: offsets, and rotor inertia where it is zero.

    Args:
        structure: Identifiable structure of the arm.
        gains: Gains for both.
        bare: Friction and base parameters.
        stated: Base parameters of the model, shape (b,).
        motor: Rotor inertia of the model, joint side [kg m^2 or kg], shape (n,).

    Returns:
        Base parameters, shape (b,), and their covariance from the deviations of rotor inertia, shape (b, b).
    """
    base, found, covariance = structure.base, np.zeros(len(stated)), np.zeros((len(stated),) * 2)
    if bare is None:
        return found, covariance
    unit, known = _gain(gains.gains[bare.reference - 1]), {each.parameter: each for each in bare.base_parameters}
    for j, joint in enumerate(bare.joints):
        gain, inertia = _gain(gains.gains[j]), base.regrouping[:, base.labels.index(f"Ia{j + 1}")]
        own = next((each for each in joint.friction if each.parameter == "off"), None)
        if own is not None and isinstance(gain, Value):
            found += own.estimate * gain.value * base.regrouping[:, base.labels.index(f"off{j + 1}")]
        k = int(np.argmax(np.abs(inertia)))  # the base parameter that it is, or is regrouped with
        if motor[j] == 0.0 and isinstance(unit, Value) and base.names[k] in known:
            shown = known[base.names[k]]
            found += max((shown.estimate * unit.value - stated[k]) / inertia[k], 0.0) * inertia
            covariance += np.outer(inertia, inertia) * (shown.std * unit.value / inertia[k]) ** 2
    return found, covariance


def known_links(in_si: BareArm | None, structure: Structure, model: Path, flange: str | None) -> Links | Unknown:
    """Return the physically consistent links nearest to the model's, or why there are none.

    Args:
        in_si: Base parameters with known gains, None without any.
        structure: Identifiable structure of the arm.
        model: Model file, whose masses are used here.
        flange: Last body of the arm, if the file has more bodies.
    """
    if in_si is None:
        return Unknown(NO_GAINS)
    try:
        nominal = nominal_links(model, flange)
        if is_placeholder(nominal):
            return Unknown(KINEMATICS_ONLY)
        found = nearest_links(structure.base, in_si.inertial, in_si.inertial_covariance, nominal)
    except (ModelFileError, NoBody) as error:
        return Unknown(str(error))
    return links_document(found, nominal, structure.arm)


def link_values(bare: BareFile | None, gains: GainsFile, arm: Arm, nominal: ModelLinks) -> tuple[Link, ...]:
    """Return links whose centre of mass is in the frame of the body in the model file.

    Args:
        bare: Results of bare motions.
        gains: The gains of the updated model.
        arm: The arm of the file.
        nominal: Links of the file.

    Raises:
        ScenarioError: If there are no physically consistent links, or they are of other gains or another model, or
            contradict the data.
    """
    if bare is None:
        raise ScenarioError("--links: no identification of bare motions is given; add --arm A")
    if (found := bare.consistent) is None:
        raise ScenarioError(
            "--links: --arm has no physically consistent set: "
            f"{bare.consistent_reason or 'it was written by an older version'}; identify bare motions with --gains"
        )
    if (names := tuple(each.name for each in found.links)) != arm.joint_names:
        raise ScenarioError(f"--links: --arm is of joints {', '.join(names)}, not of those of MODEL")
    for each in found.links:
        if not same_frames(each, arm, nominal.carried, tolerance=SAME):
            raise ScenarioError(
                f"--links: MODEL has another frame for joint {each.name}, or other bodies fixed to its link, than the "
                "model that bare motions were identified with; identify them with this file"
            )
    if found.farthest_deviations > FAR:
        raise ScenarioError(
            f"--links: base parameter {found.farthest_parameter} of physically consistent links differs by "
            f"{found.farthest_deviations:.2g} standard deviations from its estimate (limit {FAR:g}); check model, "
            "gains and data"
        )
    for joint, entry in zip(bare.joints, gains.gains, strict=True):  # masses are proportional to gains
        used, own = joint.gain, entry.estimate
        if used is not None and own is not None and abs(used / own - 1.0) > SAME:
            raise ScenarioError(
                f"--links: --arm was identified with a gain of {used:.4g} on joint {joint.joint}, but --gains has "
                f"{own:.4g}; identify the bare motions with these gains"
            )
    places = [(np.array(each.com) + nominal.offset[each.joint - 1]).tolist() for each in found.links]
    return tuple(each.model_copy(update={"com": com}) for each, com in zip(found.links, places, strict=True))
