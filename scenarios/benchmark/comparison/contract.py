"""Properties that every method should have, tested with problem folders.

Exact data give exact gains. Gains scale with mass and inversely with current, and change sign with the current; the
unit of one joint does not affect the others. The same data give the same answer. A joint without load is refused.
Errors agree with the estimated standard deviations.
"""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from pydantic import Field

from ident.estimation.gain_options import GainOptions
from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.payload.payload import Payload
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.benchmark.comparison.exact import OBSERVING, TRUSTING, Exact, exact_motions
from scenarios.benchmark.methods.call import Limits, call
from scenarios.benchmark.methods.method import Method
from scenarios.experiments.judge import Claim
from scenarios.experiments.robots import robot
from scenarios.rendering.result import ResultModel
from scenarios.results.problem_folder import write_problem
from scenarios.support.errors import MethodError

EXACT = 1e-8
"""Largest relative error with exact data; filters and differentiation cause 1e-9."""
SAME = 1e-6
"""Largest relative difference of equal gains; iterative methods have a termination error."""
SURE = 5.0
"""Largest error with noisy data, in estimated standard deviations; correct methods exceed it once in two million."""
NOISE, LOUD = 0.002, 0.02
"""White noise of the currents, as a share of their rms, with a mounted payload and without one."""
FACTOR = 1.7
UNIT = 250.0
MOVED = 2
"""Joint, from 0, whose unit is changed."""


class KeptPromise(ResultModel):
    """A property that every method should have."""

    promise: str = Field(description="The property")
    broken: str | None = Field(description="How the property is violated, null if it holds")
    kept: bool = Field(description="Whether the property holds")


class Contract(ResultModel):
    """What `rx90 compare --check M --json` prints."""

    method: str = Field(description="The method as given to --check")
    passed: bool = Field(description="Whether all properties hold")
    checks: list[KeptPromise] = Field(description="One entry per property")


Claims = tuple[Claim, ...]
Judge = Callable[[Claims], str | None]


def contract(method: Method, limits: Limits) -> Contract:
    """Test a method for all properties."""
    found = list(checks(method, limits))
    return Contract(method=method.text, passed=all(each.kept for each in found), checks=found)


def checks(method: Method, limits: Limits) -> Iterator[KeptPromise]:
    """Yield the results of `contract` one by one."""
    structure = structure_of(load_arm(robot().model))
    exact, noisy = exact_motions(structure, 1, noise=0.0), exact_motions(structure, 2, noise=NOISE)
    absent = exact_motions(structure, 3, noise=LOUD, mounted=False)

    def asked(motions: Sequence[Motion], gains: GainOptions = TRUSTING) -> Claims | MethodError:
        with tempfile.TemporaryDirectory(prefix="rx90-problem-") as place:
            write_problem(Path(place), robot(), (), motions, observing=OBSERVING, gains=gains)
            return call(method, Path(place), structure.arm.n, limits).outcome

    def judged(promise: str, answer: Claims | MethodError, judge: Judge) -> KeptPromise:
        broken = f"{type(answer).__name__}: {answer}" if isinstance(answer, MethodError) else judge(answer)
        return KeptPromise(promise=promise, broken=broken, kept=broken is None)

    promise = f"exact data give exact gains, to {EXACT:g}"
    yield judged(promise, asked(exact.motions), lambda found: _inexact(found, exact.gain))
    before = asked(noisy.motions)
    if isinstance(before, MethodError):
        yield judged("noisy data give gains", before, lambda found: None)
        return
    promise = "errors with noisy data agree with the estimated standard deviations"
    yield judged(promise, before, lambda found: _overconfident(found, noisy.gain))
    ones = np.ones(structure.arm.n)
    unit = np.where(np.arange(structure.arm.n) == MOVED, UNIT, 1.0)
    for promise, motions, factor, tolerance in (
        ("the same data give identical gains", noisy.motions, ones, 0.0),
        (f"mass and inertia times {FACTOR} scale the gains by {FACTOR}", _heavier(noisy, FACTOR), FACTOR * ones, SAME),
        (f"currents times {FACTOR} divide the gains by {FACTOR}", _scaled(noisy, FACTOR * ones), ones / FACTOR, SAME),
        ("negated currents negate the gains", _scaled(noisy, -ones), -ones, SAME),
        (f"a change of unit of joint {MOVED + 1} affects no other joint", _scaled(noisy, unit), 1.0 / unit, SAME),
    ):
        differs = partial(_differs, before=before, factor=factor, tolerance=tolerance)
        yield judged(promise, asked(motions), differs)
    promise = "a payload that is specified but not mounted gives no gain"
    yield judged(promise, asked(absent.motions, GainOptions()), _claims_something)


def _heavier(exact: Exact, factor: float) -> list[Motion]:
    """Return the same recordings with a larger assumed mass."""

    def heavier(payload: Payload) -> Payload:
        assert payload.inertia is not None, "it is stated in full"
        ixx, iyy, izz, ixy, ixz, iyz = (factor * value for value in payload.inertia)
        return replace(
            payload,
            mass=factor * payload.mass,
            mass_std=factor * payload.mass_std,
            inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        )

    return [each if each.payload is None else replace(each, payload=heavier(each.payload)) for each in exact.motions]


def _scaled(exact: Exact, factor: Array) -> list[Motion]:
    """Return the same motions with other units of the currents."""
    return [
        replace(each, recording=Recording(each.recording.t, each.recording.q, each.recording.v * factor))
        for each in exact.motions
    ]


def _inexact(found: Claims, gain: Array) -> str | None:
    refused = _joints([claim.value is None for claim in found])
    if refused:
        return f"{refused} refused, although the payload loads every joint"
    error = np.array([abs((claim.value or 0.0) / true - 1.0) for claim, true in zip(found, gain, strict=True)])
    worst = int(error.argmax())
    return f"joint {worst + 1} is off by {error[worst]:.2g} of its gain" if error[worst] > EXACT else None


def _overconfident(found: Claims, gain: Array) -> str | None:
    off = [
        claim.value is not None and claim.std is not None and not abs(claim.value - true) <= SURE * claim.std
        for claim, true in zip(found, gain, strict=True)
    ]
    return f"{_joints(off)} off by more than {SURE:g} estimated standard deviations" if any(off) else None


def _differs(found: Claims, before: Claims, factor: Array, tolerance: float) -> str | None:
    """Return how answers differ from earlier ones times a factor."""
    for joint, (now, then, times) in enumerate(zip(found, before, factor, strict=True), 1):
        if (now.value is None) != (then.value is None):
            return f"joint {joint} is {'refused' if now.value is None else 'given'} now, but was not before"
        for what, new, old in (("gain", now.value, then.value), ("deviation", now.std, then.std)):
            wanted = None if old is None else old * float(times if what == "gain" else abs(times))
            if new is None or wanted is None:
                if new is not wanted:
                    return f"the {what} of joint {joint} is in only one of the answers"
            elif abs(new - wanted) > tolerance * abs(wanted):
                return f"the {what} of joint {joint} is {new:.9g}, expected {wanted:.9g}"
    return None


def _claims_something(found: Claims) -> str | None:
    claimed = _joints([claim.value is not None for claim in found])
    return f"{claimed} given a gain" if claimed else None


def _joints(which: Sequence[bool]) -> str:
    """Return joint numbers with a verb, empty for none."""
    numbers = [str(j) for j, yes in enumerate(which, 1) if yes]
    return f"joint{'s'[: len(numbers) > 1]} {', '.join(numbers)} {'are' if numbers[1:] else 'is'}" if numbers else ""
