"""Identified values of each joint in SI, or why there are none: scale of efforts, damping, friction loss, armature.

Friction and base parameters are from the output of `rx90 identify --json` for bare motions.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.diagnosis.alternative import two_digits
from ident.model.structure import Structure
from ident.support.arrays import Array
from ident.support.file_access import read_bytes
from ident.support.naming import one_line
from ident.support.toml_files import LARGEST
from scenarios.experiments.files.gains import GainEntry, GainsFile
from scenarios.results.models.links import Links
from scenarios.support.errors import ScenarioError

NO_NOMINAL = "no data-sheet gains are given (--nominal)"
NO_BARE = "no identification of bare motions is given (--arm)"


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
    return tuple(
        JointValues(
            name=name,
            effort=_effort(gains.gains[j], None if nominal is None else nominal.gains[j], most),
            damping=_friction(gains.gains[j], bare, j, "Fv", most),
            friction=_friction(gains.gains[j], bare, j, "Fc", most),
            armature=_armature(structure, gains, bare, j, most),
        )
        for j, name in enumerate(names)
    )


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
            found += max(shown.estimate * unit.value - stated[k], 0.0) * inertia / inertia[k]
            covariance += np.outer(inertia, inertia) * (shown.std * unit.value / inertia[k]) ** 2
    return found, covariance


def _gain(entry: GainEntry) -> Value | Unknown:
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
    if name not in own:
        several = any(each.startswith(f"{name} in motion") for each in own)
        return Unknown(
            "differs between motions; identify one, or --option friction_per_motion=false"
            if several
            else "not identified"
        )
    return _times(own[name], gain, most)


def _armature(structure: Structure, gains: GainsFile, bare: BareFile | None, j: int, most: float) -> Known:
    """Return Ia if it is a base parameter, not regrouped with the inertia of links."""
    if bare is None:
        return Unknown(NO_BARE)
    name = f"Ia{j + 1}"
    found = next((each for each in bare.base_parameters if each.parameter == name), None)
    group = structure.base.groups().get(name, {})
    if set(group) != {name}:
        return Unknown("regrouped with link inertia: only their sum is identifiable")
    unit = _gain(gains.gains[bare.reference - 1])
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
        return Unknown(
            f"identified as {value:.3g}, with a standard deviation of {two_digits(100.0 * rel_std)} %, more than "
            f"{100.0 * most:g} %"
        )
    return Value(value, rel_std)
