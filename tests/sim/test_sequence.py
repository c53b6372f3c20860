"""Motions of a robot whose drives warm up, one after another."""

from dataclasses import replace

import numpy as np
import pytest
from plants import experiment, nominal_plant, short_motion, streams, try_record

from sim.effects import ModelErrors
from sim.errors import PlantError, Saturated
from sim.experiment import after_warm_up
from sim.record import record
from sim.sensors import SensorOptions

WARM = {"motor_warming": 60.0, "warming_time": 5.0, "gain_by_temperature": -0.004, "viscous_by_temperature": -0.02}
SHORT = experiment(
    trajectory=short_motion(0.8, 0.01), sensors=SensorOptions(), plant=nominal_plant(errors=ModelErrors(**WARM))
)


def sequence(*loaded: bool, warm_up: float = 0.0, pause: float = 0.0, **errors):
    plant = nominal_plant(errors=ModelErrors(**{**WARM, **errors}))
    return [
        replace(SHORT, name=f"motion {k}", plant=plant, loaded=x, earlier=k, warm_up=warm_up, pause=pause)
        for k, x in enumerate(loaded)
    ]


def warmth_by_hand(start: np.ndarray, v: np.ndarray, seconds: float = 1e-3) -> np.ndarray:
    """Of T dx/dt = W (v / v_max)^2 - x, each sample held."""
    x = start.copy()
    for row in 60.0 * (v / SHORT.plant.drives.current_limit) ** 2:
        x = row + (x - row) * np.exp(-seconds / 5.0)
    return x


def seen_warmth(experiments, monkeypatch) -> tuple[list, list[np.ndarray]]:
    """Recordings, and the temperatures that the motions started with."""
    starts: list[np.ndarray] = []
    import sim.record

    plain = sim.record.varied

    def watched(*args, warmth=None, **rest):
        starts.append(np.zeros(6) if warmth is None else warmth.copy())
        return plain(*args, warmth=warmth, **rest)

    monkeypatch.setattr(sim.record, "varied", watched)
    return record(experiments, streams(*range(len(experiments))), threads=1), starts


def test_drives_go_on_as_warm_as_the_motion_before_left_them_but_for_the_pause(monkeypatch):
    motions = sequence(False, True, False, pause=3.7)
    recordings, starts = seen_warmth(motions, monkeypatch)
    x = np.zeros(6)
    for recording, start in zip(recordings, starts, strict=True):
        np.testing.assert_allclose(start, x, rtol=1e-12, atol=1e-15)  # 800 roundings
        x = warmth_by_hand(x, recording.v) * np.exp(-3.7 / 5.0)
    assert starts[2].max() > 0.3


def test_a_motion_is_the_same_alone_and_beside_others_of_other_robots():
    pair, other = sequence(False, True), sequence(True, False, motor_warming=90.0)
    alone = record(pair, streams(1, 2), threads=1)
    beside = record([*pair, *other, SHORT], streams(1, 2, 3, 4, 5), threads=1)
    for one, two in zip(alone, beside[:2], strict=True):
        assert one.v.tobytes() == two.v.tobytes()
    assert beside[2].v.tobytes() != beside[0].v.tobytes()


def test_a_warm_up_is_the_motion_repeated_for_its_time(monkeypatch):
    # Eight motions one after another. One takes a sixth of the time constant, so that heat near its end counts for more
    # than its mean: some per cent of what settles.
    motions = sequence(*[False] * 9)
    _, starts = seen_warmth(motions, monkeypatch)
    monkeypatch.undo()
    _, warmed = seen_warmth(sequence(False, warm_up=8 * 0.801), monkeypatch)
    assert len(warmed) == 3  # two of the warm-up, and the motion itself
    np.testing.assert_allclose(warmed[2], starts[8], rtol=0.04)
    assert not warmed[0].any()
    assert (warmed[1] < warmed[2]).all()


def test_a_warm_up_before_a_loaded_motion_is_bare_and_the_later_motions_have_none(monkeypatch):
    _, warmed = seen_warmth(sequence(True, warm_up=12.0), monkeypatch)
    _, bare = seen_warmth(sequence(False, True, warm_up=12.0), monkeypatch)
    np.testing.assert_array_equal(warmed[2], bare[2])
    assert len(bare) == 4


def test_warmth_after_a_warm_up_has_a_closed_form():
    v = np.outer([3.0, 4.0], [1.0, 2.0, 0.5, 0.0, 1.0, 2.0])
    load = 12.5 * np.array([1.0, 4.0, 0.25, 0.0, 1.0, 4.0]) / SHORT.plant.drives.current_limit**2
    found = after_warm_up(replace(SHORT, warm_up=8.0), v, 0.25)
    np.testing.assert_allclose(found, 60.0 * load * (1.0 - np.exp(-2.0 / 5.0)), rtol=1e-14)  # some roundings


def test_a_motion_without_the_one_before_it_is_refused():
    first, second, third = sequence(False, True, False)
    for wrong in ([second], [first, third], [second, first], [first, replace(second, plant=nominal_plant()), third]):
        outcomes = try_record(wrong, streams(*range(len(wrong))), threads=1)
        with pytest.raises(PlantError, match=r"motion \d: drives warm up, but the preceding"):
            raise next(o for o in outcomes if isinstance(o, Exception))


def test_after_a_motion_that_failed_there_is_none():
    first, second, third = sequence(False, True, False)
    weak = replace(
        first.plant, drives=replace(first.plant.drives, current_limit=np.array([480.0, 50.0, 240.0, 110.0, 80.0, 45.0]))
    )
    broken = replace(first, plant=weak)
    outcomes = try_record([broken, second, third, *sequence(False)], streams(0, 1, 2, 3), threads=1)
    assert [type(outcome) for outcome in outcomes[:3]] == [Saturated] * 3
    assert outcomes[0] is outcomes[1] is outcomes[2]
    assert not isinstance(outcomes[3], Exception)
    for each in try_record([replace(broken, warm_up=9.0)], streams(0), threads=1):
        assert str(each).startswith("warm-up before motion 0: drive of joint2 at its limit")
