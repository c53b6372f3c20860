"""One fault of the logs has one name in every command that sees them, and none of them blames a gain for it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

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
LIGHT = Payload(mass=3.1, com=(0.05, 0.02, 0.06), inertia=(0.01, 0.012, 0.008, 0.0, 0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What commands see, sound but for one thing: logs bare, loaded and bare again, payload, gains and gravity."""

    bare: Recording
    loaded: Recording
    again: Recording
    light: Recording
    payload: Payload = BRICK
    gain: tuple[float, ...] = tuple(GAIN.tolist())
    tilt: float = 0.0

    def of_loaded(self, change: Callable[[Recording], Recording]) -> "Seen":
        return replace(self, loaded=change(self.loaded), again=change(self.again))


def scaled(joint: int, factor: float) -> Callable[[Seen], Seen]:
    return lambda seen: seen.of_loaded(lambda x: changed(x, v=x.v * at(joint, factor, 1.0, 3)))


def times(payload: Payload, factor: float) -> Payload:
    return replace(payload, mass=factor * payload.mass, inertia=tuple(factor * x for x in payload.inertia))


OF_LOGS: dict[str, tuple[str, tuple[int, ...], Callable[[Seen], Seen]]] = {
    "v2 is scaled by 1.1": ("current scale", (1,), scaled(1, 1.15)),
    "v3 is negated": ("current sign", (2,), scaled(2, -1.0)),
    "all currents are scaled by 1000": ("current scale", (), lambda x: x.of_loaded(lambda y: changed(y, v=1e3 * y.v))),
    "t must be multiplied by 0.8": ("clock", (), lambda x: x.of_loaded(lambda y: changed(y, t=1.25 * y.t))),
    "the currents are logged": ("delay", (), lambda x: x.of_loaded(lambda y: late(y, 4))),
    "columns v2 and v3 are exchanged": (
        "order", (1, 2), lambda x: x.of_loaded(lambda y: changed(y, v=exchanged(y.v, 1, 2))),
    ),
    "the base is": ("base", (), lambda x: replace(x, tilt=5.0)),
}  # fmt: skip
"""Faults that every command sees, by words for them: name, joints, and how they come."""
OF_PAYLOAD: dict[str, Callable[[Seen], Seen]] = {
    "centre": lambda x: replace(x, payload=replace(BRICK, com=(0.13, -0.05, 0.11))),
    "mounting": lambda x: replace(x, payload=replace(BRICK, com=(0.05, 0.07, 0.11))),
    "bare log that was loaded": lambda x: replace(x, bare=replace(x.light, name="bare")),
}
"""Faults of what is said of the payload, which commands that are told nothing of it do not see."""


@pytest.fixture(scope="module")
def sound() -> Seen:
    bare, loaded, again, light = logs_of(Truth(), 7, (None, BRICK, None, LIGHT))
    return Seen(bare=bare, loaded=loaded, again=replace(again, name="again"), light=light)


def said(seen: Seen) -> dict[str, Diagnosed | str]:
    """Diagnoses of each command, or the message with which it refuses the logs."""
    c, s = np.cos(np.radians(seen.tilt)), np.sin(np.radians(seen.tilt))
    arm = arm_of(three_axes())
    x, y, z = arm.gravity
    axes = structure_of(replace(arm, gravity=np.array([c * x + s * z, y, c * z - s * x])))
    pair, asked = [seen.bare, seen.loaded], {"observing": ObserveOptions(), "gains": GainOptions()}

    def blaming_none() -> Diagnosed:
        found = weighed(axes, seen, seen.payload)
        assert blamed(found) == []
        return found.found

    commands: dict[str, Callable[[], Diagnosed]] = {
        "check": lambda: check(pair, axes, loaded=(False, True), payload=seen.payload, **asked).found,
        "identify": lambda: identify(axes, mounted(*pair, seen.payload), **asked).found,
        "verify": blaming_none,
        "payload-of": lambda: weighed(axes, seen, None).found,
        "bare": lambda: doubts(prepare([Motion(seen.bare), Motion(seen.again)], axes)).found,
    }
    found = dict[str, Diagnosed | str]()
    for command, carried_out in commands.items():
        try:
            found[command] = carried_out()
        except IdentificationError as error:
            found[command] = str(error)
    return found


def weighed(axes: Structure, seen: Seen, payload: Payload | None) -> Weighing:
    gains = [
        {"joint": j, "name": name, "estimate": gain, "std": 0.003 * abs(gain)}
        for j, (name, gain) in enumerate(zip(axes.arm.joint_names, seen.gain, strict=True), 1)
    ]
    file = GainsFile.model_validate({"gains": gains})
    return weighing(axes, [seen.bare], [seen.loaded], file, weighed=payload, delay=None, policy=DOUBTED)


def blamed(found: Weighing) -> list[int]:
    """Joints whose gains are said to be off."""
    assert found.verified is not None
    common = common_error(found.verified)
    apart = found.verified.joints if common is None else common.apart
    return [each.joint for each in apart if common is not None or each.verdict == DIFFERS]


@pytest.mark.parametrize(
    "words", [pytest.param(each, marks=() if each.startswith("v2") else pytest.mark.slow) for each in OF_LOGS]
)
def test_a_fault_of_the_logs_has_one_name_in_every_command_and_no_gain_is_blamed_for_it(sound, words):
    name, joints, change = OF_LOGS[words]
    for command, found in said(change(sound)).items():
        if isinstance(found, str):  # refused, for the fault of the logs and nothing else
            assert words in found.partition(";")[0], command
        else:
            of_it = [each for each in found.findings if each.name == name]
            assert [(each.joints, words in each.sentence) for each in of_it] == [(joints, True)], command


@pytest.mark.parametrize(
    "fault", [pytest.param(each, marks=() if each == "centre" else pytest.mark.slow) for each in OF_PAYLOAD]
)
def test_a_payload_that_is_not_as_stated_is_named_wherever_it_is_stated_and_no_gain_is_blamed(sound, fault):
    found = said(OF_PAYLOAD[fault](sound))
    for command in ("check", "identify", "verify"):
        one = found[command]
        sentences = [one] if isinstance(one, str) else [each.sentence for each in one.findings]
        assert any("the payload's centre of mass seems to differ" in each for each in sentences), command
    assert isinstance(found["payload-of"], Diagnosed)
    assert found["payload-of"].severity is not Severity.WRONG


def test_a_mass_that_is_stated_wrong_blames_no_gain_and_a_gain_that_is_off_no_log(sound):
    axes = structure_of(arm_of(three_axes()))
    for wrong, expected in (
        (sound, []),
        (replace(sound, payload=times(BRICK, 1.2)), []),
        (replace(sound, gain=tuple(GAIN * (1.0, 1.2, 1.0))), [1]),
    ):
        found = weighed(axes, wrong, wrong.payload)
        assert found.found.severity is not Severity.WRONG
        assert blamed(found) == expected
        assert found.verified.passed is (wrong is sound)
