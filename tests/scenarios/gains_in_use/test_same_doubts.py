"""One fault of the logs has one name in every command that sees them, and none of them blames a gain for it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import at, changed, exchanged, late, logs_of
from known_logs import BRICK, arm_of, mounted
from real_friction import GAIN, Truth, three_axes

from ident.diagnosis.diagnosis import Diagnosed, Severity
from ident.estimation.problem import GainOptions
from ident.identification import check, doubts, identify
from ident.model.structure import Structure, structure_of
from ident.observation.observation import ObserveOptions
from ident.parameters.weighing import DIFFERS, common_error
from ident.payload.payload import Payload
from ident.preparation import DOUBTED, prepare
from ident.recordings.recording import Motion, Recording
from ident.support.errors import IdentificationError
from scenarios.gains_in_use.known_gains import Weighing, weighing
from scenarios.results.gains_file import GainsFile

pytestmark = pytest.mark.usefixtures("_computed_once")
FAULTS: dict[str, tuple[str, tuple[int, ...], Callable[[Recording], Recording]]] = {
    "v2 is scaled by 1.1": ("current scale", (1,), lambda x: changed(x, v=x.v * at(1, 1.15, 1.0, 3))),
    "v3 is negated": ("current sign", (2,), lambda x: changed(x, v=x.v * at(2, -1.0, 1.0, 3))),
    "all currents are scaled by 1000": ("current scale", (), lambda x: changed(x, v=1e3 * x.v)),
    "t must be multiplied by 0.8": ("clock", (), lambda x: changed(x, t=1.25 * x.t)),
    "the currents are logged": ("delay", (), lambda x: late(x, 4)),
    "columns v2 and v3 are exchanged": ("order", (1, 2), lambda x: changed(x, v=exchanged(x.v, 1, 2))),
}
"""Of a log, by words for them: name, joints, and how they come."""


@pytest.fixture(scope="module")
def axes() -> Structure:
    return structure_of(arm_of(three_axes()))


@pytest.fixture(scope="module")
def sound() -> list[Recording]:
    """Bare, loaded, and bare again."""
    *pair, again = logs_of(Truth(), 7, (None, BRICK, None))
    return [*pair, replace(again, name="again")]


def weighed(axes: Structure, pair: Sequence[Recording], payload: Payload | None, gain: np.ndarray = GAIN) -> Weighing:
    gains = [
        {"joint": j, "name": name, "estimate": each, "std": 0.003 * abs(each)}
        for j, (name, each) in enumerate(zip(axes.arm.joint_names, gain.tolist(), strict=True), 1)
    ]
    file, (bare, loaded) = GainsFile.model_validate({"gains": gains}), pair
    return weighing(axes, [bare], [loaded], file, weighed=payload, delay=None, policy=DOUBTED)


def blamed(found: Weighing) -> list[int]:
    """Joints whose gains are said to be off."""
    assert found.verified is not None
    common = common_error(found.verified)
    apart = found.verified.joints if common is None else common.apart
    return [each.joint for each in apart if common is not None or each.verdict == DIFFERS]


@pytest.mark.parametrize(
    "words", [pytest.param(each, marks=() if each.startswith("v2") else pytest.mark.slow) for each in FAULTS]
)
def test_a_fault_of_the_logs_has_one_name_in_every_command_and_no_gain_is_blamed_for_it(axes, sound, words):
    name, joints, change = FAULTS[words]
    pair, again = [sound[0], change(sound[1])], change(sound[2])
    asked = {"observing": ObserveOptions(), "gains": GainOptions()}

    def blaming_none() -> Diagnosed:
        found = weighed(axes, pair, BRICK)
        assert blamed(found) == []
        return found.found

    commands: dict[str, Callable[[], Diagnosed]] = {
        "check": lambda: check(pair, axes, loaded=(False, True), payload=BRICK, **asked).found,
        "identify": lambda: identify(axes, mounted(*pair, BRICK), **asked).found,
        "verify": blaming_none,
        "payload-of": lambda: weighed(axes, pair, None).found,
        "bare": lambda: doubts(prepare([Motion(pair[0]), Motion(again)], axes)).found,
    }
    for command, carried_out in commands.items():
        try:
            told = [(each.joints, words in each.sentence) for each in carried_out().findings if each.name == name]
        except IdentificationError as error:  # refused, for the fault of the logs and nothing else
            told = [(joints, words in str(error).partition(";")[0])]
        assert told == [(joints, True)], command


def test_a_mass_that_is_stated_wrong_blames_no_gain_and_a_gain_that_is_off_no_log(axes, sound):
    heavier = replace(BRICK, mass=1.2 * BRICK.mass, inertia=tuple(1.2 * x for x in BRICK.inertia))
    for payload, factor, expected in ((BRICK, 1.0, []), (heavier, 1.0, []), (BRICK, 1.2, [1])):
        found = weighed(axes, sound[:2], payload, GAIN * (1.0, factor, 1.0))
        assert found.found.severity is not Severity.WRONG
        assert blamed(found) == expected
        assert found.verified.passed is (payload is BRICK and factor == 1.0)
