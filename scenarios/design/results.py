"""What commands that design print: a robot begun from its model, a weight made for a scenario, a motion."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

import scenarios.design.new_robot as new_robot
import scenarios.design.payload_design as payload_design
from ident.payload.files import payload_to_table
from ident.support.arrays import Array
from scenarios.design.motion_formats.limits import MotionLimits
from scenarios.design.motion_formats.sampled import SampledMotion
from scenarios.design.payload_search import Candidate
from scenarios.design.prediction import RESIDUAL, Deviations
from scenarios.design.searched_motion import SearchedMotion
from scenarios.design.weights import SHAPES
from scenarios.support.result_model import ResultModel


class NewRobot(ResultModel):
    """What `rx90 new-robot --json` prints.

    Attributes:
        robot: Its name.
        joints: Names of the joints in their order.
        predicted_rel_std: Relative standard deviation of each gain that the motion found lets one expect, for residuals
            of 2 % of the torque.
        identifiable: Whether the scenario that was written wants each joint's gain.
        files: That were written.
    """

    robot: str
    joints: list[str]
    predicted_rel_std: list[float]
    identifiable: list[bool]
    files: list[str]


def new_robot_result(new: new_robot.NewRobot, found: new_robot.Found, files: Sequence[Path]) -> NewRobot:
    """A robot that was described, and the files that say so."""
    return NewRobot(
        robot=new.name,
        joints=list(new.arm.joint_names),
        predicted_rel_std=found.predicted.tolist(),
        identifiable=list(found.identifiable),
        files=list(map(str, files)),
    )


class DesignedJoint(ResultModel):
    """What a joint sees of a payload.

    Attributes:
        joint: Its number, from 1.
        wanted: Whether a weight is searched that shows its gain.
        payload_std: Relative standard deviation of the gain from what is uncertain of the payload.
        shown: Whether identification would give the gain.
    """

    joint: int = Field(ge=1)
    wanted: bool
    payload_torque_rms: float = Field(description="rms of the payload's part of the joint's torque [N m or N]")
    std: float | None = Field(description="predicted from the residual, as a share of the gain")
    payload_std: float | None
    shown: bool


class DesignedPayload(ResultModel):
    """A payload and what the joints see of it.

    Attributes:
        payload: With the keys of a payload file.
        joints: One entry a joint, in their order.
    """

    payload: dict[str, object]
    joints: list[DesignedJoint]


class _Shape(ResultModel):
    shape: str = Field(description="its name")
    dimensions_mm: dict[str, float] = Field(description="by their names [mm]")
    turned_deg: int = Field(description="about the flange's axis [degrees]")
    density: float = Field(description="of the material [kg/m^3]")
    refusal: str | None = Field(description="why it must not be mounted, null if it may be")


class DesignedWeight(DesignedPayload, _Shape):
    """A weight that could be made, and what the joints see of it."""


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints.

    Attributes:
        scenario: Its name.
        residual: Standard deviation of the residual that is expected, as a share of each joint's rms torque.
        flange: Frame of the model that the weight is mounted on, null where the last joint's axis stands for one.
        before: The scenario's own payload.
        after: The weight to make.
        candidates: The best weight of each shape, the best first and those that must not be mounted last.
    """

    scenario: str
    residual: float
    rated_load: float | None = Field(description="largest mass that the arm may carry, null if its file says none [kg]")
    own_is_better: bool = Field(description="whether the scenario's own payload identifies the worst joint better")
    flange: str | None
    before: DesignedPayload
    after: DesignedPayload
    candidates: list[DesignedWeight]


def payload_design_result(design: payload_design.PayloadDesign) -> PayloadDesign:
    """What a design came to."""
    return PayloadDesign(
        scenario=design.scenario.name,
        residual=RESIDUAL,
        rated_load=design.most,
        own_is_better=design.worst(design.before.deviations) <= design.worst(design.after.deviations),
        flange=design.flange.name or None,
        before=_payload(design, design.before),
        after=_payload(design, design.after),
        candidates=[_weight(design, each) for each in design.candidates],
    )


def _payload(design: payload_design.PayloadDesign, found: payload_design.Before | Candidate) -> DesignedPayload:
    return DesignedPayload(
        payload=payload_to_table(found.payload), joints=_joints(design, found.deviations, found.torque)
    )


def _weight(design: payload_design.PayloadDesign, found: Candidate) -> DesignedWeight:
    weight = found.weight
    names = (each.name for each in SHAPES[weight.shape].dimensions)
    return DesignedWeight(
        shape=weight.shape,
        dimensions_mm=dict(zip(names, weight.dimensions, strict=True)),
        turned_deg=90 * weight.quarter,
        density=weight.density,
        refusal=found.refusal or None,
        payload=payload_to_table(found.payload),
        joints=_joints(design, found.deviations, found.torque),
    )


def _joints(design: payload_design.PayloadDesign, found: Deviations, torque: Array) -> list[DesignedJoint]:
    return [
        DesignedJoint(
            joint=j + 1,
            wanted=j in design.problem.joints,
            payload_torque_rms=float(torque[j]),
            std=_finite(found.noise[j]),
            payload_std=_finite(found.payload[j]),
            shown=bool(design.shows(found)[j]),
        )
        for j in range(len(torque))
    ]


class Sampled(ResultModel):
    """What `rx90 trajectory --json` prints; a number a joint.

    Attributes:
        out: The file that was written.
        format: Its form, as --format names it.
        samples: Times that each joint has a position for.
        duration_s: Time of the last sample, the first being at 0 [s].
        beyond_limits: Limits of the arm that the motion breaks, in words, a joint and limit each.
    """

    out: str
    format: str
    samples: int
    duration_s: float
    start: list[float] = Field(description="first position of each joint [rad or m]")
    max_velocity: list[float] = Field(description="largest speed of each joint [rad/s or m/s]")
    max_acceleration: list[float] = Field(description="largest acceleration of each joint [rad/s^2 or m/s^2]")
    beyond_limits: list[str]


def sampled_result(motion: SampledMotion, limits: MotionLimits, out: Path, form: str) -> Sampled:
    """A motion that was written.

    Args:
        motion: The motion.
        limits: Of the arm.
        out: The file.
        form: Its form.
    """
    return Sampled(
        out=str(out),
        format=form,
        samples=len(motion.t),
        duration_s=float(motion.t[-1]),
        start=motion.q[0].tolist(),
        max_velocity=np.abs(motion.dq).max(axis=0).tolist(),
        max_acceleration=np.abs(motion.ddq).max(axis=0).tolist(),
        beyond_limits=list(limits.broken_by(motion)),
    )


class Searched(ResultModel):
    """What `rx90 excite --json` prints.

    Attributes:
        out: The motion file that was written.
        cost_of_start: The `cost`, of logarithms too, of the motion that the search began with.
        cost: What the search makes small: logarithms of the wanted gains' relative deviations, mostly of the worst, and
            a penalty on limits that the motion exceeds. A lower one is better.
    """

    out: str
    tried: int = Field(description="motions")
    cost_of_start: float
    cost: float
    predicted_rel_std: list[float | None] = Field(
        description="relative standard deviation of each gain, null where the motion does not determine it"
    )


def searched_result(found: SearchedMotion, start: float, cost: float, out: Path) -> Searched:
    """A motion that was found.

    Args:
        found: The motion.
        start: Cost of the motion that the search began with.
        cost: Of the one that was found.
        out: The file.
    """
    return Searched(
        out=str(out),
        tried=found.tried,
        cost_of_start=start,
        cost=cost,
        predicted_rel_std=list(map(_finite, found.deviations)),
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
