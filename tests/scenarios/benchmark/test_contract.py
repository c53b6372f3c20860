"""`rx90 compare --check`: each promise is broken by a method that breaks it alone, and told in a sentence."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from method_stubs import constant
from printed import printed

import scenarios.benchmark.comparison.contract as contract
from ident.estimation.gain_options import GainOptions
from ident.model.arm import load_arm
from ident.model.structure import Structure, structure_of
from ident.recordings.motion import Motion
from scenarios.benchmark.comparison.contract import checks
from scenarios.benchmark.comparison.exact import PAYLOAD, TRUSTING, Exact, exact_motions
from scenarios.benchmark.methods.call import Call, Limits
from scenarios.benchmark.methods.method import Method
from scenarios.cli import main
from scenarios.experiments.judge import Claim
from scenarios.experiments.robots import robot
from scenarios.results.problem_folder import read_problem
from scenarios.support.errors import MethodCrashed


@cache
def moved(seed: int, noise: float, mounted: bool) -> Exact:
    """The motions of a problem, once for all methods that are asked."""
    return exact_motions(structure_of(load_arm(robot().model)), seed, noise=noise, mounted=mounted)


def posed(structure: Structure, seed: int, *, noise: float, mounted: bool = True) -> Exact:
    return moved(seed, noise, mounted)


Change = Callable[[int, list[Claim]], list[Claim]]
EXACT, NOISY, ABSENT = 1, 2, 3
"""Seeds of the problems."""
STD = 1e-3
"""Stated, as a share of the gain."""


@pytest.fixture(scope="module")
def known(structure: Structure):
    return {seed: exact_motions(structure, seed, noise=0.0) for seed in (EXACT, NOISY, ABSENT)}


@dataclass(frozen=True)
class Posed:
    """What a method is asked about."""

    motions: Sequence[Motion]
    gains: GainOptions


def perfect(problem: Posed, known) -> tuple[int, list[Claim]]:
    """What a method would say that sees through everything: which problem it is, and claims that follow its units."""
    bare, loaded = problem.motions
    seed = next(s for s, each in known.items() if np.array_equal(each.motions[0].recording.q, bare.recording.q))
    payload = loaded.payload
    factor = payload.mass / PAYLOAD.mass
    np.testing.assert_allclose(payload.inertia, factor * np.array(PAYLOAD.inertia), rtol=1e-12)
    assert payload.com == PAYLOAD.com
    assert payload.mass_std == pytest.approx(factor * PAYLOAD.mass_std)
    before = known[seed].motions[0].recording.v
    with np.errstate(divide="ignore"):
        unit = np.median(bare.recording.v / before, axis=0)
    # Nothing is refused that shows at all, but where refusing is what is asked for.
    assert problem.gains == (GainOptions() if seed == ABSENT else TRUSTING)
    if seed == ABSENT:
        return seed, [Claim(None, None, "nothing there")] * 6
    gain = known[seed].gain * factor / np.where(np.abs(unit - np.round(unit, 1)) < 0.05, np.round(unit, 1), unit)
    return seed, [Claim(float(g), STD * abs(float(g)), None) for g in gain]


def run(monkeypatch, known, change: Change, *, by_files: bool = False) -> dict[str, str | None]:
    """What is said of a method that changes perfect claims, by promise; it reads the folder only `by_files`."""
    asked = list[Posed]()

    def kept(folder, robot, links, motions, *, observing, gains) -> None:
        asked.append(Posed(motions, gains))

    def called(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
        assert joints == 6
        given = read_problem(folder) if by_files else None
        seed, claims = perfect(Posed(given.motions, given.gains) if given else asked[-1], known)
        return Call(outcome=tuple(change(seed, claims)), seconds=0.1)

    if not by_files:
        monkeypatch.setattr(contract, "write_problem", kept)
    monkeypatch.setattr(contract, "call", called)
    monkeypatch.setattr(contract, "exact_motions", posed)
    return {check.promise: check.broken for check in checks(Method("m", ()), Limits())}


def broken(said: dict[str, str | None]) -> dict[str, str]:
    return {promise: text for promise, text in said.items() if text is not None}


def scaled(claims: list[Claim], factor: float) -> list[Claim]:
    return [replace(claim, value=claim.value * factor) if claim.value else claim for claim in claims]


def test_a_method_that_keeps_everything_is_told_so(monkeypatch, known):
    said = run(monkeypatch, known, lambda seed, claims: claims, by_files=True)
    assert len(said) == 8
    assert broken(said) == {}


def test_a_method_without_deviations_breaks_nothing(monkeypatch, known):
    assert not broken(run(monkeypatch, known, lambda seed, claims: [replace(claim, std=None) for claim in claims]))


def of_problem(which: int, change: Callable[[list[Claim]], list[Claim]]) -> Change:
    return lambda seed, claims: change(claims) if seed == which else claims


def only(joint: int, change: Callable[[Claim], Claim]) -> Callable[[list[Claim]], list[Claim]]:
    return lambda claims: [change(claim) if j == joint else claim for j, claim in enumerate(claims, 1)]


BREAKERS = [
    (
        of_problem(EXACT, only(4, lambda claim: replace(claim, value=claim.value * (1.0 + 1.2e-8)))),
        "exact data give exact gains",
        "joint 4 is off by 1.2e-08 of its gain",
    ),
    (
        of_problem(EXACT, only(2, lambda claim: Claim(None, None, "no"))),
        "exact data give exact gains",
        "joint 2 is refused, although the payload loads every joint",
    ),
    (
        of_problem(NOISY, lambda claims: scaled(claims, 1.0 + 5.2 * STD)),
        "errors with noisy data agree",
        "joints 1, 2, 3, 4, 5, 6 are off by more than 5 estimated standard deviations",
    ),
    (
        of_problem(ABSENT, only(3, lambda claim: Claim(2.0, 9.0, None))),
        "a payload that is specified but not mounted",
        "joint 3 is given a gain",
    ),
]


@pytest.mark.parametrize(("change", "promise", "message"), BREAKERS, ids=[message for *_, message in BREAKERS])
def test_a_promise_that_is_broken_alone_is_told_alone(change, promise, message, monkeypatch, known):
    said = broken(run(monkeypatch, known, change))
    assert [text for text in said if text.startswith(promise)] == list(said)
    assert list(said.values()) == [message]


def test_what_is_small_enough_breaks_nothing(monkeypatch, known):
    def almost(seed: int, claims: list[Claim]) -> list[Claim]:
        return scaled(claims, {EXACT: 1.0 + 0.9e-8, NOISY: 1.0 + 4.8 * STD, ABSENT: 1.0}[seed])

    assert not broken(run(monkeypatch, known, almost))


def test_a_method_that_rolls_dice_is_found_out(monkeypatch, known):
    rolls = iter(range(100))

    def dice(seed: int, claims: list[Claim]) -> list[Claim]:
        return scaled(claims, 1.0 + 1e-13 * next(rolls))

    said = broken(run(monkeypatch, known, dice))
    assert list(said) == ["the same data give identical gains"]


def test_a_method_that_does_not_look_at_units_breaks_every_scale(monkeypatch, known):
    def blind(seed: int, claims: list[Claim]) -> list[Claim]:
        return [Claim(float(g), STD * abs(float(g)), None) for g in known[seed].gain] if seed != ABSENT else claims

    said = broken(run(monkeypatch, known, blind))
    assert list(said.values()) == [
        "the gain of joint 1 is 0.94, expected 1.598",
        "the gain of joint 1 is 0.94, expected 0.552941176",
        "the gain of joint 1 is 0.94, expected -0.94",
        "the gain of joint 3 is 25, expected 0.1",
    ]


def test_a_deviation_that_does_not_scale_and_one_that_comes_and_goes_are_found_out(monkeypatch, known):
    stiff = broken(run(monkeypatch, known, lambda seed, claims: [replace(c, std=c.std and 9.0) for c in claims]))
    assert "the deviation of joint 1 is 9, expected 15.3" in stiff.values()
    assert not any("other sign" in promise for promise in stiff)  # a deviation has none
    calls = iter(range(100))

    def fickle(seed: int, claims: list[Claim]) -> list[Claim]:
        return claims if next(calls) != 3 else [replace(claim, std=None) for claim in claims]

    said = broken(run(monkeypatch, known, fickle))
    assert list(said.values()) == ["the deviation of joint 1 is in only one of the answers"]
    calls = iter(range(100))
    said = broken(
        run(monkeypatch, known, lambda s, claims: claims if next(calls) != 4 else [Claim(None, None, "")] * 6)
    )
    assert list(said.values()) == ["joint 1 is refused now, but was not before"]


def test_a_method_that_crashes_is_asked_no_further(monkeypatch):
    monkeypatch.setattr(contract, "call", lambda *_: Call(outcome=MethodCrashed("exit status 3: why?"), seconds=0.1))
    found = list(checks(Method("m", ()), Limits()))
    assert [check.broken for check in found] == ["MethodCrashed: exit status 3: why?"] * 2


def test_the_command_tells_that_all_is_kept_and_its_status_says_so(capsys):
    assert main(["compare", "--check", "ls-2011", "--json"]) == 0
    said = printed(capsys, "compare-check")
    assert said["passed"]
    assert all(check["kept"] for check in said["checks"])


def test_the_command_tells_what_is_broken_and_its_status_says_so(monkeypatch, capsys):
    asked = []

    def one_for_all(method: Method, *_: object) -> Call:
        asked.append(method.text)
        return Call(outcome=(Claim(1.0, 0.25, None),) * 6, seconds=0.1)

    monkeypatch.setattr(contract, "call", one_for_all)
    text = f"method_stubs:{constant.__name__}"
    assert main(["compare", "--check", text]) == 1
    assert set(asked) == {text}
    told = capsys.readouterr().out
    assert "Not fulfilled: negated currents negate the gains" in told
    assert "FAILED: " in told
