"""The model that logs are doubted against: what it knows of each joint, and what it must not know."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import doubted, logs_of
from known_logs import BRICK
from real_friction import Truth

from ident.diagnosis.evidence import BLOCKS
from ident.diagnosis.free_model import free_columns, free_model, row_counts
from ident.estimation.rows import joint_rows


def share_left(columns: np.ndarray, x: np.ndarray) -> float:
    """Share of a signal that columns leave."""
    unit = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return float(np.linalg.norm(x - unit @ np.linalg.lstsq(unit, x)[0]) / np.linalg.norm(x))


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_the_columns_span_what_a_log_of_its_own_friction_and_any_payload_may_hold(sound, joint):
    rows = joint_rows(sound.problem, joint)
    W = free_columns(sound.problem, rows)
    loaded = rows.motion == 1
    rng = np.random.default_rng(4)
    friction = rows.W[:, [rows.names.index(f"{name}{joint + 1}") for name in ("Fv", "Fc", "off")]]
    speed = friction[:, 0]
    known = {
        "the arm": rows.W @ rng.normal(size=rows.W.shape[1]),
        "friction of the loaded log": friction @ [0.3, -2.0, 0.7] * loaded,
        "a payload": rows.W_L[0] @ rng.normal(size=10),
        "friction by direction": np.abs(speed),
    }
    for name, each in known.items():
        assert share_left(W, each) < 1e-6, name  # rounding, of a condition of 1e4
    unknown = {"time": np.linspace(0.0, 1.0, len(rows.V)) * rows.V}
    if joint < 2:  # of the last link, a payload is as good as the link itself
        unknown["an arm of its own in one log"] = rows.W @ rng.normal(size=rows.W.shape[1]) * loaded
    for name, each in unknown.items():
        assert share_left(W, each) > 1e-3, name


def test_nothing_that_is_stated_of_a_payload_enters(axes, sound):
    wrong = replace(BRICK, mass=0.1, com=(0.5, -0.5, 0.5), known="mass")
    other = doubted(axes, sound.recordings, (None, wrong))
    np.testing.assert_array_equal(other.model.fits.score.squares, sound.model.fits.score.squares)


def test_logs_of_one_mounting_share_its_payload_and_others_have_their_own(axes):
    twin = replace(BRICK)
    logs = logs_of(Truth(), payloads=(None, BRICK, BRICK))
    widths = [
        free_columns(problem, joint_rows(problem, 1)).shape[1]
        for problem in (
            doubted(axes, logs, payloads).problem for payloads in ((None, BRICK, BRICK), (None, BRICK, twin))
        )
    ]
    assert widths[1] - widths[0] == 10


def test_friction_in_proportion_to_the_motors_torque_is_no_fault_of_a_log(axes):
    loads = (0.08, 0.12, 0.1)
    plain, braked = (doubted(axes, logs_of(Truth(load_motor=each))) for each in ((0.0,) * 3, loads))
    # Of white noise of 1 % of each current; without the column 2.5 % are left on joint 2.
    for each in (plain, braked):
        for j, rows in enumerate(each.model.rows):
            assert each.model.fits.sigma[j] < 0.008 * np.sqrt(np.mean(rows.V**2))


def test_a_column_that_the_model_has_besides_is_explained(sound):
    rng = np.random.default_rng(8)
    extra = [rng.normal(size=(len(rows.V), 2)) for rows in sound.model.rows]
    model = free_model(sound.problem, (extra[0], None, extra[2]))
    for j, given in enumerate(extra):
        left = np.linalg.norm(model.fits.parts[j].fit.without(given)) / np.linalg.norm(given)
        assert (left < 1e-3) == (j != 1)


def test_a_joint_with_fewer_rows_than_unknowns_has_no_fit(sound):
    def short(joint):
        rows = slice(0, 12)
        names = ("V", "W", "W_L", "weight", "t", "position")
        return replace(joint, **{name: getattr(joint, name)[rows] for name in names})

    motions = tuple(
        replace(
            m,
            observation=replace(
                m.observation, joints=(m.observation.joints[0], short(m.observation.joints[1]), m.observation.joints[2])
            ),
        )
        for m in sound.problem.motions
    )
    model = free_model(replace(sound.problem, motions=motions))
    assert [each is None for each in model.fits.parts] == [False, True, False]
    assert not model.fits.score.rows[1].any()


def test_every_log_has_its_blocks_and_rows_are_counted_with_those_left_out(sound):
    counts = row_counts(sound.problem)
    seen = [motion.observation.joints for motion in sound.problem.motions]
    assert counts == [1 + max(int(each.position[-1]) for each in joints) for joints in seen]
    assert sound.model.fits.score.rows.shape == (3, 2 * BLOCKS)
    for j in range(3):
        for log, joints in enumerate(seen):
            expected = np.bincount(joints[j].position * BLOCKS // counts[log], minlength=BLOCKS)
            np.testing.assert_array_equal(sound.model.fits.score.rows[j, BLOCKS * log : BLOCKS * (log + 1)], expected)
