"""A loaded motion that no fit has used, from exact states, and models that predict it."""

from dataclasses import replace

import numpy as np
from exact import GAIN, TRUSTING, exact_problem

from ident.estimation.intervals import JointPrediction
from ident.estimation.known_gains import KnownGains
from ident.model.structure import Structure
from ident.payload.payload import Payload
from ident.recordings.recording import Motion, Recording
from ident.unseen import UnseenMotion, UsedModel

LOG = Motion(Recording(np.arange(9.0), *2 * [np.outer(np.arange(9.0), np.ones(6))], "new"), None)
"""Its samples are nobody's: what they give is made apart."""
FIT = {2: JointPrediction(joint=2, share=0.02, fitted=0.017)}


def loaded_motion(structure: Structure, heavy: Payload, rng: np.random.Generator) -> tuple[UnseenMotion, np.ndarray]:
    """Exact states of a loaded motion, ready to be predicted, and the arm's base parameters."""
    chi = rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, heavy, heavy)], GAIN, rng, options=TRUSTING, noise=1e-3)
    unseen = UnseenMotion(log=replace(LOG, payload=heavy), parts=problem.motions)
    return unseen, structure.base.regrouping @ chi


def model(
    structure: Structure, base: np.ndarray, gain: np.ndarray, joints: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
) -> UsedModel:
    at = np.array(joints)
    gains = KnownGains(
        names=structure.arm.joint_names, joints=at, value=gain[at], covariance=np.zeros((len(at), len(at)))
    )
    return UsedModel(gains=gains, base=base, covariance=np.zeros((len(base), len(base))), fits=FIT)
