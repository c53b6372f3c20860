"""What logs exclude: faults of the size that is told are surely worse, and smaller ones are not."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import all_joints, at, doubted, logs_of, problem_of
from known_logs import BRICK
from real_friction import Truth

from ident.diagnosis.diagnosis import Effect, Exclusion
from ident.diagnosis.effects import HeldOutEstimate
from ident.diagnosis.evidence import log_density_improvement
from ident.diagnosis.limits import (
    LIMITS,
    SIZES,
    bounds,
    centres_excluded,
    exclusions,
    largest_undetected,
    undetectable,
    undetectable_together,
    undetected_sizes,
)
from ident.diagnosis.screening import SURELY_WORSE, Screened
from ident.diagnosis.search import SHOWN, Survey, survey
from ident.diagnosis.terms import payload_errors
from ident.estimation.estimate import GainEstimate
from ident.estimation.intervals import z_of
from ident.payload.payload import Payload


def excluded(seen: Survey) -> list[Exclusion]:
    """What the logs exclude."""
    return list(exclusions(seen, undetected_sizes(seen)))


def hidden(seen: Survey, base: HeldOutEstimate | None = None) -> list[str]:
    """What the logs cannot reveal of single joints and of scales."""
    return list(undetectable(seen, undetected_sizes(seen), base))


def open_together(seen: Survey) -> bool:
    return any(each.startswith("whether") for each in undetectable_together(seen, undetected_sizes(seen)))


@pytest.fixture(scope="module")
def seen(six) -> Survey:
    return survey(six)


def gains_of(estimate: GainEstimate) -> np.ndarray:
    return np.array([each.value for each in estimate.joints])


def direction(seen: Survey, *key: object, logs: tuple[int, ...] = (0, 1)):
    return next(each for each in seen.directions if (each.family, each.joints, each.logs) == (*key, logs))


def test_the_bound_is_where_predictions_of_every_block_are_worse_by_as_much_as_is_sure(six, seen):
    fits = six.fits

    def z(found, size: float) -> float:
        squares = fits.score.squares.copy()
        for j, part in enumerate(fits.parts):
            if found.columns[j] is not None:
                left = part.residual[:, None] - size * part.without(found.columns[j])
                squares[j] = np.sum(part.predicted(left) ** 2, axis=(1, 2))
        return z_of(log_density_improvement(fits.score, replace(fits.score, squares=squares)))

    families = ("zero", "delay", "clock", "current scale", "lengths")
    all_found = [each for each in seen.directions if each.family in families and len(each.joints) < 2][::5]
    sizes = bounds(fits, all_found)
    assert sum(size is not None for size in sizes) > 4
    assert None in sizes
    for found, size in zip(all_found, sizes, strict=True):  # every size up to it is tested, without bisection
        worse = [max(z(found, x), z(found, -x)) < -SHOWN for x in found.largest * SIZES]
        assert size == (found.largest * SIZES[worse.index(True)] if any(worse) else None), found.key


def test_what_is_excluded_is_told_with_the_largest_size_of_a_family(six, seen):
    found = {each.family: each for each in excluded(seen) if each.limit is not None}
    zeros = found["zero"]
    limits = bounds(six.fits, [direction(seen, "zero", (j,)) for j in zeros.joints])
    np.testing.assert_allclose(zeros.limit, np.rad2deg(max(limits)), rtol=0.05)  # two digits
    each = ", ".join(f"{np.rad2deg(x):.2g} (q{j + 1})" for j, x in zip(zeros.joints, limits, strict=True))
    assert zeros.sentence == f"zeros beyond {each} degrees"
    late = [each.sentence for each in excluded(seen) if each.family == "delay"]
    assert late[0].startswith("delays of all currents beyond ")
    for family, logs, scale, words in (
        ("delay", (0, 1), 1e3, "delays of one current in one log beyond {} ms"),
        ("current scale", (1,), 100.0, "errors of one current's scale in one log beyond {} %"),
    ):
        sizes = [bounds(six.fits, [direction(seen, family, (j,), logs=(k,)) for k in logs]) for j in range(6)]
        shown = {j: scale * max(size) for j, size in enumerate(sizes) if None not in size}
        assert found[family].joints == tuple(shown)
        each = ", ".join(f"{size:.2g} (v{j + 1})" for j, size in shown.items())
        assert found[family].sentence == words.format(each)


def faint(seen: Survey, family: str, factor: float) -> Survey:
    """Of small faults one family alone, of which the logs show less."""
    own = [each for each in seen.directions if each.family == family]
    less = [replace(each, columns=tuple(c if c is None else factor * c for c in each.columns)) for each in own]
    return replace(seen, directions=tuple(less))


def test_scales_and_clocks_that_are_not_excluded_are_said_to_be_untold_with_what_they_move(axes):
    recorded = logs_of(Truth(), seed=3)
    logs = doubted(axes, recorded)
    seen, base = survey(logs), HeldOutEstimate(logs.problem, all_joints(logs.problem))

    def moved(*wrong) -> float:
        after = gains_of(all_joints(problem_of(axes, wrong)))
        return float(100.0 * np.abs(after / gains_of(base.estimate) - 1.0).max())

    plain = [each for each in hidden(seen) if each.startswith("scale")]
    assert plain == ["scale of v1 to 3 in one log", "scale of all currents in one log"]  # nothing excludes them
    assert "scale of v1 to 3 in one log" in hidden(faint(seen, "current scale", 1e-6))
    bare, heavy = recorded
    told = next(each for each in hidden(seen, base) if each.startswith("scale of v"))
    expected = max(moved(bare, replace(heavy, v=heavy.v * at(joint, 1.01, 1.0, 3))) for joint in range(3))
    np.testing.assert_allclose(float(told.split()[-2]), expected, rtol=0.1)  # first order, and two digits
    assert not any("clock" in each for each in hidden(seen, base))  # these logs exclude it
    both, one = (each for each in hidden(faint(seen, "clock", 1e-3), base) if "clock" in each)
    assert both.startswith("rate of the clock (1 % changes a gain by ")
    assert one.startswith("rate of the clock of one log (1 % changes a gain by ")
    slow = [replace(each, t=1.001 * each.t) for each in recorded]
    for told, wrong in ((both, [slow]), (one, [(slow[0], heavy), (bare, slow[1])])):
        expected = 1e-3 * 10.0 * max(moved(*each) for each in wrong)  # faint; of 1 %
        np.testing.assert_allclose(float(told.split()[-2]), expected, rtol=0.1)


def test_what_is_bounded_is_not_said_to_be_untold(seen):
    lengths = [each for each in seen.gross if each.alternative.family == "lengths"]
    assert lengths
    kept = replace(seen, gross=tuple(replace(each, gain=0.0 * each.gain) for each in lengths))
    assert not open_together(kept)
    assert open_together(replace(kept, directions=tuple(each for each in seen.directions if each.family != "lengths")))


def test_readings_are_excluded_where_they_lose_surely_and_told_where_they_do_not(seen):
    of_joint = {each.alternative.joints: each.alternative for each in seen.gross if each.alternative.family == "sign"}
    one, two = of_joint[1,], of_joint[3,]

    def said(*losses: float) -> list[str]:
        made = tuple(Screened(each, -x) for each, x in zip((one, two), losses, strict=True))
        return [each.sentence for each in excluded(replace(seen, gross=made)) if each.limit is None]

    assert said(1.01 * SURELY_WORSE, 1.02 * SURELY_WORSE) == ["opposite sign of q2, 4"]
    assert said(0.99 * SURELY_WORSE, 1.02 * SURELY_WORSE) == ["opposite sign of q4"]
    assert said(0.99 * SURELY_WORSE, 0.98 * SURELY_WORSE) == []


def test_what_a_vertical_axis_hides_is_said_of_its_joint(seen):
    said = hidden(seen)
    assert "zero of q1" in said
    assert not any(each.endswith(" of q2") for each in said)


def test_half_a_turn_that_is_not_seen_is_told_apart_from_any_zero(seen):
    every = (each.alternative for each in seen.gross)
    zeros = [each for each in every if (each.family, each.joints, each.logs) == ("zero", (4,), (0, 1))]
    assert sorted(each.value for each in zeros) == [-180.0, -90.0, 90.0]

    def said(*open_ones: float) -> list[str]:
        gross = [Screened(each, SURELY_WORSE * (-0.9 if each.value in open_ones else -1.1)) for each in zeros]
        return hidden(replace(seen, gross=tuple(gross), directions=()))

    assert said(-180.0) == ["zero of q5 off by half a turn"]
    assert said(-180.0, 90.0) == ["zero of q5"]
    assert said(-90.0) == ["zero of q5"]
    assert said() == []


def test_a_centre_that_is_twice_as_far_off_as_is_excluded_is_found(axes):
    logs = logs_of(Truth(), seed=4)

    def base(weighed: Payload) -> HeldOutEstimate:
        problem = problem_of(axes, logs, (None, weighed))
        return HeldOutEstimate(problem, all_joints(problem))

    (excluded,) = centres_excluded(base(BRICK))
    assert excluded.family == "payload centre"

    def moved_by(offset: np.ndarray) -> HeldOutEstimate:
        return base(replace(BRICK, com=tuple(np.array(BRICK.com) + offset)))

    def z(of: HeldOutEstimate) -> float:
        (centre,) = (each for each in payload_errors(of.problem, of.estimate) if each.family == "payload centre")
        return z_of(of.each_added([centre])[0].u)

    sound = base(BRICK)
    off = np.array([gains_of(moved_by(1e-3 * axis).estimate) for axis in np.eye(3)])
    moved = 100.0 * np.abs(off / gains_of(sound.estimate) - 1.0).max()
    told = f"errors of the payload's centre beyond {excluded.limit:g} mm (1 mm changes a gain by {moved:.1g} %)"
    assert excluded.sentence == told
    assert z(sound) < SHOWN < min(z(moved_by(2e-3 * excluded.limit * axis)) for axis in np.eye(3))
    known = replace(BRICK, com_std=(0.01, 0.01, 0.01))
    assert list(centres_excluded(base(known))) == []


def test_the_largest_undetected_fault_has_the_largest_effect_in_deviations_at_its_limit(seen, six):
    base = HeldOutEstimate(six.problem, all_joints(six.problem))
    zero = direction(seen, "zero", (2,))
    one = replace(seen, directions=(zero,))
    told = largest_undetected(one, undetected_sizes(one), base)
    (size,) = bounds(six.fits, [zero])
    assert told.startswith(f"zeros up to {np.rad2deg(size):.2g} degrees (q3) (1 degree changes a gain by ")
    sizes, clock = undetected_sizes(seen), direction(seen, "clock", ())
    (limit,) = (limit for _, limit in LIMITS if limit.words == "errors of the clock")
    huge = {**sizes, limit: {((), "%"): 1e6}}
    assert largest_undetected(seen, huge, base).startswith("errors of the clock up to 1e+06 % (1 % changes a gain by ")
    unlimited = replace(seen, directions=(clock,))
    assert largest_undetected(unlimited, {**sizes, limit: {}}, base).startswith("errors of the clock of any size (1 % ")


def test_a_large_error_of_an_uncertain_gain_is_less_than_a_small_one_of_a_certain_gain(seen):
    few = {(j,): direction(seen, "zero", (j,)) for j in (1, 2)}

    class Moved:
        def stacked(self, columns):
            self.effect = {id(few[1,].columns): (9.0, 2.0), id(few[2,].columns): (4.0, -7.0)}[id(columns)]
            return np.ones((1, 1))

        def effects(self, currents):
            return (Effect(joint=0, percent=self.effect[0], deviations=self.effect[1]),)

    some = replace(seen, directions=tuple(few.values()))
    assert "(q3)" in largest_undetected(some, undetected_sizes(some), Moved())
