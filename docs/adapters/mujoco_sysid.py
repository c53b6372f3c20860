"""MuJoCo's system identification as a method: `docs.adapters.mujoco_sysid:drive_gains`.

    pip install "mujoco[sysid]>=4.0"
    rx90 compare nominal --method docs.adapters.mujoco_sysid:drive_gains -n 5 --time-limit 600 --out compared

Unknown are the pseudo-inertia of every link and what is not known of a payload, the rotor inertia, viscous and Coulomb
friction and offset of every joint, and the currents per torque, log 1/g. Predicted are the currents: MuJoCo's inverse
dynamics of the measured motion, filtered as for every method here, over g, and friction. (The library's own rollout is
of a model under measured currents; without a controller its errors add up along the motion. Hence `custom_rollout`.)

What it lacks: a start (links are balls of 10 kg on their joints, gains what makes currents as large as they are);
anything that keeps parameters which the data do not show (here a weak prior, `PRIOR`); a rule of refusal (here
`max_rel_std`, a gain that ends at its bounds, a search that does not end); any share of the payload's own deviation in
its deviations, which take residuals as white. Not modelled: couplings of joints, friction of the load, compliance.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from ident.numerics.signals import delayed, edge_samples, group_means, smooth_motion
from ident.payload.payload import Payload
from ident.recordings.recording import Motion, resampled
from ident.support.arrays import Array
from scenarios.results.problem_folder import PROBLEM, GivenProblem

try:
    import mujoco.sysid as sysid
    from mujoco.sysid import Parameter, ParameterDict, SystemTrajectory, TimeSeries, model_modifier
except ImportError as error:
    raise ImportError('mujoco.sysid or what it needs is missing; pip install "mujoco[sysid]>=4.0"') from error

Residual = Callable[..., tuple[list[Array], object, object]]
ROW = 0.04
"""Time that samples are averaged over to a row [s]."""
PRIOR = 1e-4
"""Weight of a parameter's distance from its start, whose unit is about the parameter's size."""
SEARCH = {"optimizer": "scipy_parallel_fd", "x_scale": "jac", "ftol": 3e-5, "max_iters": 60}
"""Of the library's searches this one ends after some 15 steps; its default has not ended after 60."""
START = 10.0, (0.3, 0.3, 0.3)
"""Mass [kg] and moments of inertia [kg m^2] of every link."""
FAR = 7.0
"""Bound of the logarithm of a gain, from its start."""
LINK = {
    "mass_bound_mult": np.array([1e-3, 1e3]),
    "ipos_bound_off": np.array([-1.0, 1.0]),
    "stretch_bound_mult": np.array([1e-4, 1e4]),
    "shear_bound_off": np.array([-5.0, 5.0]),
}
"""Bounds of a pseudo-inertia, as factors or distances from `START` or a payload's."""


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """One motion as rows: t (N,), q, dq, ddq, v (N, n), and whether a joint is away from reversal (N, n)."""

    t: Array
    q: Array
    dq: Array
    ddq: Array
    v: Array
    moving: Array


def drive_gains(problem: GivenProblem) -> Sequence[Mapping[str, object]]:
    """Find the gains of a problem, and refuse those with a deviation above its `max_rel_std`.

    Args:
        problem: All motions are used; its folder must be there, for the model.

    Returns:
        For each joint `estimate` and `std` [N m / drive unit], or a `reason`.
    """
    n = problem.arm.n
    if all(each.payload is None or each.payload.known == "none" for each in problem.motions):
        return [{"reason": "no motion carries a payload of which anything is known"}] * n
    rows = [_rows(each, problem) for each in problem.motions]
    specs, params = _models(problem)
    size = np.sqrt(np.mean(np.vstack([each.v for each in rows]) ** 2, axis=0))
    torque = np.vstack([_torque(spec.compile(), each) for spec, each in zip(specs, rows, strict=True)])
    power = np.vstack([each.v * each.dq for each in rows]).mean(axis=0)  # friction dissipates
    h = np.where(power < 0.0, -1.0, 1.0) * size / np.sqrt(np.mean(torque**2, axis=0))
    for name in ("viscous", "coulomb", "offset"):
        params.add(Parameter(name, np.zeros(n), np.full(n, -10.0), np.full(n, 10.0)))
    params.add(Parameter("log 1/g", np.zeros(n), np.full(n, -FAR), np.full(n, FAR)))  # the last: see below
    motions = [_residual(spec, each, h, size) for spec, each in zip(specs, rows, strict=True)]
    start = params.as_vector()

    def residual(x: Array, given: ParameterDict) -> tuple[list[Array], list[object], list[object]]:
        told = [each(x, given)[0][0] for each in motions]
        return [*told, PRIOR * (x - (start if x.ndim == 1 else start[:, None]))], [], []

    found, result = sysid.optimize(params, residual, verbose=False, **SEARCH)
    if result.status <= 0:
        return [{"reason": f"the search has not ended after {SEARCH['max_iters']} steps"}] * n
    left = [part[part != 0.0] for part in residual(result.x.ravel(), found)[0]]  # zeros are rows at a reversal
    covariance, _ = sysid.calculate_intervals(left, result.jac)
    log, share = found["log 1/g"].value, np.sqrt(np.diag(covariance)[-n:])
    return [_gain(*of, problem.gains.max_rel_std) for of in zip(h.tolist(), log.tolist(), share.tolist(), strict=True)]


def _rows(motion: Motion, problem: GivenProblem) -> _Rows:
    options, recording = problem.observing, resampled(motion.recording)
    period = recording.period
    edge, group = edge_samples(period, options.cutoff_hz), max(1, round(ROW / period))
    v = delayed(recording.v, options.current_delay / period)
    moved = smooth_motion(recording.q, period, options.cutoff_hz)
    t, q, dq, ddq, v = (group_means(x[edge:-edge], group) for x in (recording.t, *moved, v))
    moving = np.abs(dq) > options.reversal_speed * np.sqrt(np.mean(dq**2, axis=0))
    return _Rows(t, q, dq, ddq, v, moving.astype(np.float64))


def _models(problem: GivenProblem) -> tuple[list[mujoco.MjSpec], ParameterDict]:
    """A model for each motion, and the parameters that they share: links, rotors, what is unknown of payloads."""
    assert problem.folder is not None, "the problem is a folder"
    file = problem.folder / json.loads((problem.folder / PROBLEM).read_text(encoding="utf-8"))["robot"]["model"]
    plain, params = _plain_model(file, problem.arm.joint_names), ParameterDict()
    model = plain.compile()
    links = [plain.joint(name).parent.name for name in problem.arm.joint_names]
    for link in links:
        modify = partial(_set_link, link)
        params.add(sysid.body_inertia_param(plain, model, link, sysid.InertiaType.Pseudo, **LINK, modifier=modify))
    n = problem.arm.n
    low, high = np.full(n, -FAR), np.full(n, FAR)
    params.add(Parameter("log rotors", np.zeros(n), low, high, modifier=partial(_set_rotors, problem.arm.joint_names)))
    mounted: dict[int, str] = {}
    specs: list[mujoco.MjSpec] = []
    for motion in problem.motions:
        spec = plain.copy()
        if motion.payload is not None:
            name = mounted.setdefault(id(motion.payload), f"payload-{len(mounted) + 1}")
            _mount(spec, links[-1], name, motion.payload)
            if motion.payload.known != "all" and name not in params:
                params.add(_payload_parameter(spec, name, motion.payload))
        specs.append(spec)
    return specs, params


def _plain_model(file: Path, joints: Sequence[str]) -> mujoco.MjSpec:
    """The problem's model with a motor and a sensor of its force on every joint."""
    spec = mujoco.MjSpec.from_file(str(file))
    for joint in joints:
        link = spec.joint(joint).parent
        link.mass, link.inertia = START
        spec.joint(joint).limited = mujoco.mjtLimited.mjLIMITED_FALSE
        spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        spec.add_sensor(
            name=joint, objname=joint, objtype=mujoco.mjtObj.mjOBJ_ACTUATOR, type=mujoco.mjtSensor.mjSENS_ACTUATORFRC
        )
    return spec


def _set_rotors(joints: Sequence[str], spec: mujoco.MjSpec, parameter: Parameter) -> None:
    for name, log in zip(joints, parameter.value, strict=True):
        spec.joint(name).armature = np.exp(log)


def _set_link(name: str, spec: mujoco.MjSpec, parameter: Parameter) -> None:
    """As the library's modifier of a pseudo-inertia, whose result MuJoCo 4.0.0 does not compile."""
    _set_inertia(spec.body(name), parameter.value)


def _set_inertia(body: mujoco.MjsBody, theta: Array) -> None:
    mass, *first = (pi := model_modifier.pi_from_theta(theta))[:4]
    body.mass, body.ipos = mass, np.array(first) / mass
    skew = model_modifier.skew(body.ipos)
    about = pi[4:].reshape(3, 3) + mass * skew @ skew  # about the centre of mass
    body.inertia, body.iquat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    body.fullinertia = about[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]


def _mount(spec: mujoco.MjSpec, link: str, name: str, payload: Payload) -> None:
    """Add a payload; of what is unknown, something small that a body may have."""
    ball = 0.01 * payload.mass
    inertia = payload.inertia if payload.known == "all" and payload.inertia else (ball, ball, ball, 0.0, 0.0, 0.0)
    body = spec.body(link).add_body(name=name, mass=payload.mass, explicitinertial=True)
    body.ipos = payload.com if payload.known in ("all", "com") and payload.com else (0.0, 0.0, 0.0)
    body.fullinertia = inertia


def _payload_parameter(spec: mujoco.MjSpec, name: str, payload: Payload) -> Parameter:
    """Pseudo-inertia of a payload without its mass, or, if that is known, its centre of mass."""
    whole = sysid.body_inertia_param(spec.copy(), spec.compile(), name, sysid.InertiaType.Pseudo, **LINK)
    chosen = {"none": slice(0, 10), "mass": slice(1, 10), "com": slice(1, 7)}[payload.known]

    def modify(other: mujoco.MjSpec, parameter: Parameter) -> None:
        body, theta = other.body(name), whole.nominal.copy()
        theta[chosen] = parameter.value
        if body is not None:  # another motion is without it
            _set_inertia(body, theta)

    bounds = (whole.min_value[chosen], whole.max_value[chosen])
    return Parameter(name, whole.nominal[chosen], *bounds, modifier=modify)


def _residual(spec: mujoco.MjSpec, rows: _Rows, h: Array, size: Array) -> Residual:
    """Residual of one motion, in shares of each joint's currents, as the library weighs them."""
    names = TimeSeries.compute_all_sensor_mapping(spec.compile())
    state = sysid.create_initial_state(spec.compile(), rows.q[0], rows.dq[0])
    control, measured = TimeSeries(rows.t, rows.v), TimeSeries(rows.t, rows.moving * rows.v, names)
    return sysid.build_residual_fn(
        models_sequences=[sysid.ModelSequences("arm", spec, "motion", state, control, measured)],
        custom_rollout=partial(_predicted, rows, h, size),
        n_threads=1,
        resample_true=False,
    )


def _predicted(
    rows: _Rows,
    h: Array,
    size: Array,
    *,
    models: Sequence[mujoco.MjModel],
    param_dicts: Sequence[ParameterDict],
    control_signal: Sequence[TimeSeries],
    initial_states: Sequence[Array],
    rollout_signal_mapping: Mapping[str, object],
    **_: object,  # the library passes more
) -> Sequence[SystemTrajectory]:
    """Currents of each model, the first row left out, as the library leaves it out of what was measured."""
    found: list[SystemTrajectory] = []
    speed = rows.dq / np.sqrt(np.mean(rows.dq**2, axis=0))
    for k, (model, params) in enumerate(zip(models, param_dicts, strict=True)):
        friction = params["viscous"].value * speed + params["coulomb"].value * np.sign(speed) + params["offset"].value
        v = rows.moving * (h * np.exp(params["log 1/g"].value) * _torque(model, rows) + size * friction)
        told = TimeSeries(rows.t[1:], v[1:], dict(rollout_signal_mapping))
        states = TimeSeries(rows.t[1:], np.column_stack((rows.t, rows.q, rows.dq))[1:])
        found.append(SystemTrajectory(model, control_signal[k], told, initial_states[k], states))
    return found


def _torque(model: mujoco.MjModel, rows: _Rows) -> Array:
    """Torque that a model needs for a motion, shape (N, n)."""
    data, torque = mujoco.MjData(model), np.empty_like(rows.q)
    for k, state in enumerate(zip(rows.q, rows.dq, rows.ddq, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        torque[k] = data.qfrc_inverse
    return torque


def _gain(h: float, log: float, share: float, most: float) -> Mapping[str, object]:
    if abs(log) > 0.99 * FAR:
        return {"reason": "the gain ends at a bound of the search"}
    if not share <= most:
        return {"reason": f"relative deviation {100.0 * share:.3g} % exceeds {100.0 * most:g} %"}
    gain = 1.0 / (h * float(np.exp(log)))
    return {"estimate": gain, "std": abs(gain) * share}
