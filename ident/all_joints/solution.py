"""From a problem to a solution: columns, reduction, start, search, and again with the torques that were found."""

from dataclasses import replace

import numpy as np

from ident.all_joints.columns import JointColumns, SharedParameters, joint_columns, shared_parameters
from ident.all_joints.fit import AllJointsFit, fitted
from ident.all_joints.friction import OwnColumns, own_columns
from ident.all_joints.model import OwnModel
from ident.all_joints.reduction import reduced_joint
from ident.all_joints.search import Prior, search
from ident.all_joints.start import start_of
from ident.all_joints.torques import friction_at_full_rate, torques
from ident.arrays import Array
from ident.errors import NotIdentifiable
from ident.estimate import GainSolution
from ident.problem import Problem

PASSES = 2
"""Fits after the first one, where columns follow from torques that a fit must give."""


def solved(problem: Problem, model: OwnModel) -> GainSolution:
    """The solution of a problem.

    Raises:
        NotIdentifiable: If no known payload parameter sets the scale.
    """
    shared = shared_parameters(problem)
    if not shared.known.any():
        raise NotIdentifiable("nothing that is known sets the scale of the gains; mount a payload of known mass")
    columns = joint_columns(problem, shared)
    n = len(columns)
    simple = [{name: c for name, c in _speed_columns(problem, j, model).items()} for j in range(n)]
    fit, own = _fit(problem, columns, simple, model, None)
    if {"load", "load-motor"} & set(model.friction) or model.compliance:
        for _ in range(PASSES):
            extra, softened = _torque_columns(problem, shared, fit, own, model)
            grown = columns
            if model.compliance:
                grown = tuple(
                    replace(each, shared=np.hstack((each.shared, soft))) for each, soft in zip(columns, softened, strict=True)
                )
            fit, own = _fit(problem, grown, [a | b for a, b in zip(simple, extra, strict=True)], model, fit.found.h)
    return _solution(problem, columns, own, fit)


def _fit(
    problem: Problem,
    columns: tuple[JointColumns, ...],
    extra: list[dict[str, Array]],
    model: OwnModel,
    before: Array | None,
) -> tuple[AllJointsFit, list[OwnColumns]]:
    own = [own_columns(each, more, per_motion=model.per_motion) for each, more in zip(columns, extra, strict=True)]
    joints = [reduced_joint(each, F) for each, F in zip(columns, own, strict=True)]
    h = start_of(problem, joints, own).h if before is None else before
    prior = Prior(mean=np.log(np.abs(h)), std=np.full(len(h), model.prior_std))
    found = search(joints, h, prior)
    return fitted(columns, own, joints, found, prior, problem.row_period), own


def _speed_columns(problem: Problem, joint: int, model: OwnModel) -> dict[str, Array]:
    """Columns that follow from the speed alone."""
    if "cbrt" not in model.friction:
        return {}
    parts = list[Array]()
    for motion in problem.motions:
        behind, rows = motion.observation.full_rate, motion.observation.joints[joint]
        assert behind is not None
        parts.append(behind.decimated(friction_at_full_rate(behind, joint)["cbrt"], joint)[rows.position])
    return {"cbrt": np.concatenate(parts)}


def _torque_columns(
    problem: Problem, shared: SharedParameters, fit: AllJointsFit, own: list[OwnColumns], model: OwnModel
) -> tuple[list[dict[str, Array]], list[Array]]:
    n = problem.structure.arm.n
    load: list[list[Array]] = [[] for _ in range(n)]
    motor: list[list[Array]] = [[] for _ in range(n)]
    soft: list[list[Array]] = [[] for _ in range(n)]
    for number, motion in enumerate(problem.motions):
        behind = motion.observation.full_rate
        assert behind is not None
        found = torques(problem, motion, shared, fit.found.theta, compliance=model.compliance)
        for j in range(n):
            position, turns = motion.observation.joints[j].position, np.sign(behind.dq[:, j])
            tau = found.rigid[:, j]
            load[j].append(behind.decimated(np.abs(tau) * turns, j)[position])
            signals = friction_at_full_rate(behind, j)
            brakes = np.zeros_like(tau)
            seen = dict[str, int]()
            for name, value in zip(own[j].names, fit.phi[j], strict=True):
                seen[name] = seen.get(name, -1) + 1
                if name in ("Fv", "Fc") and (not model.per_motion or seen[name] == number):
                    brakes += value * signals[name]
            drive = fit.found.h[j] * tau + brakes
            motor[j].append(behind.decimated(np.abs(drive) * turns, j)[position])
            if model.compliance:
                soft[j].append(np.column_stack([behind.decimated(found.softened[:, j, k], j)[position] for k in range(n)]))
    extra = [
        {
            name: np.concatenate(parts[j])
            for name, parts in (("load", load), ("load-motor", motor))
            if name in model.friction
        }
        for j in range(n)
    ]
    return extra, [np.vstack(each) for each in soft] if model.compliance else []


def _solution(
    problem: Problem, columns: tuple[JointColumns, ...], own: list[OwnColumns], fit: AllJointsFit
) -> GainSolution:
    n, h, rows = len(columns), fit.found.h, fit.rows
    each_h = h[rows.joint]
    payload = np.concatenate([each.payload for each in columns], axis=1)  # (mountings, r, 10)
    sensitivity = np.einsum("kr,mrp->kmp", fit.log_influence * each_h, payload)
    friction, influence = np.zeros((n, 2)), np.zeros((n, 2, len(rows.V)))
    for j, (each, phi, phi_influence) in enumerate(zip(own, fit.phi, fit.phi_influence, strict=True)):
        for k, name in enumerate(each.names):
            if name in ("Fv", "Fc"):
                column = each.F[:, k]
                size = float(np.sqrt(np.mean(column[column != 0.0] ** 2)))
                for which in (0, 1) if name == "Fc" else (0,):
                    friction[j, which] += size * phi[k]
                    influence[j, which] += size * phi_influence[k]
    loaded = np.concatenate([each.payload.any(axis=(0, 2)) for each in columns])
    known = np.concatenate([each.known for each in columns])
    return GainSolution(
        rows=rows,
        joints=np.arange(n),
        inverse=h,
        influence=h[:, None] * fit.log_influence,
        sensitivity=sensitivity,
        load_rms=np.array([np.sqrt(np.mean(known[loaded & (rows.joint == j)] ** 2)) for j in range(n)]),
        friction=friction,
        friction_influence=influence,
        unsolved={},
    )
