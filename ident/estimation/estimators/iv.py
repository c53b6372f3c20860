"""Drive gains joint by joint with instruments from a smooth motion (after Janot, Vandanjon and Gautier 2014, IDIM-IV).

Encoder noise enters the regressor and biases least squares towards small inertias. Instruments are the same columns
along a motion without that noise: x = (Z^T W)^-1 Z^T V. A log has no reference motion, so a smoothing spline of its
positions replaces it. It is only approximately an instrument, as it retains the low frequencies of the noise.

With the default filters the low-pass has already removed the noise of an encoder of 5e-4 rad at 1 kHz, so the method
has no advantage; the noise of one of 1.5e-3 rad at 50 Hz is 180 times as dense. With 5e-4 rad and cut-offs of 40 and
30 Hz, least squares have errors of 1.5 to 5 %, this method of 0 to 0.4 % (`docs/derivations.md`).
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainEstimate, judge_identifiability
from ident.estimation.joint_by_joint import GainSystem, JointFit, gain_system, joint_by_joint, joint_fit
from ident.estimation.problem import NoOptions, ObservedMotion, Problem
from ident.model.parameters import STANDARD
from ident.numerics.least_squares import least_squares
from ident.observation.observation import JointObservation, reduced
from ident.observation.smooth_motion import reference
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

NAME = "iv"


def instrumental_gains(problem: Problem, _: NoOptions | None = None) -> GainEstimate:
    """Estimate each joint's drive gain independently, with instruments and all known parameters of a payload."""
    problem.check_difference()
    along, kept = instruments(problem)
    known = [payload.known_part() for payload in problem.payloads]

    def solver(system: GainSystem, rank_tol: float) -> JointFit:
        aid = gain_system(along, system.joint, known)
        assert aid is not None, "the kinematics decide, and they are the same"
        return instrumental(system, aid.W, rank_tol)

    fits = [joint_fit(problem, joint, known, solver) for joint in range(problem.structure.arm.n)]
    # A fit with a share of the coefficients retains the frequencies below that share of the cut-off. Position noise is
    # white; the spectrum of acceleration noise grows with the fourth power of frequency.
    remark = (
        f"the instruments retain up to {100.0 * kept:.2g} % of the noise variance of positions, "
        f"{100.0 * kept**5:.2g} % of that of accelerations"
    )
    return replace(judge_identifiability(NAME, problem, joint_by_joint(problem, fits, known)), remarks=(remark,))


def instruments(problem: Problem) -> tuple[Problem, float]:
    """Return the problem along a smooth fit of each recorded motion, whose regressors are instruments of the same rows.

    Also returns the largest share of the variance of position noise that remains in these motions.
    """
    structure, motions, kept = problem.structure, list[ObservedMotion](), 0.0
    for number, motion in enumerate(problem.motions):
        behind = motion.observation.full_rate
        if behind is None:
            raise NotIdentifiable(
                f"motion {number + 1} has rows but no recording; {NAME} needs it for the smooth reference motion"
            )
        smooth = reference(behind)
        kept = max(kept, float(smooth.kept.max()))
        states = smooth.q, smooth.dq, smooth.ddq
        _, W = reduced(structure, states, np.zeros_like(behind.q), behind.moving, behind.decimator)
        joints = list[JointObservation]()
        for j, rows in enumerate(motion.observation.joints):
            base, load = structure.base.columns[rows.columns], structure.payload_columns
            before = len(STANDARD) * structure.first_links[j]
            of_arm, of_payload = (W[j][np.ix_(rows.position, each - before)] for each in (base, load))
            joints.append(replace(rows, W=of_arm, W_L=of_payload))
        motions.append(replace(motion, observation=replace(motion.observation, joints=tuple(joints))))
    return replace(problem, motions=tuple(motions)), kept


def instrumental(system: GainSystem, Z: Array, rank_tol: float) -> JointFit:
    """Solve Z^T W x = Z^T V with instruments Z (r, b) (Janot, Vandanjon and Gautier 2014); raises `NotIdentifiable`.

    The residual is V - W x, the covariance sigma^2 (Z^T W)^-1 Z^T Z (W^T Z)^-1.
    """
    W, V = system.W, system.rows.V
    plain, aid = (least_squares(each, V, rank_tol=rank_tol) for each in (W, Z))
    scale = np.linalg.norm(W, axis=0)
    through = aid.basis.T @ (W / scale)
    singular = np.linalg.svd(through, compute_uv=False)
    if singular[-1] < rank_tol * singular[0]:
        raise NotIdentifiable(
            "the reference motion does not excite every parameter: relative singular value "
            f"{singular[-1] / singular[0]:.1e} is below {rank_tol:.0e}"
        )
    by_current = linalg.solve(through, aid.basis.T, check_finite=False) / scale[:, None]
    x = by_current @ V
    residual = V - W @ x
    sigma = float(np.linalg.norm(residual) / np.sqrt(len(V) - len(x)))
    fit = replace(plain, x=x, cofactor=by_current @ by_current.T, sigma=sigma, residual=residual)
    return JointFit(system, fit, by_current)
