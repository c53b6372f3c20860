"""Motion files at their limits."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.experiments.motions import LARGEST, LONGEST, motion_digest, read_motion
from scenarios.support.errors import ScenarioError

SINE, COSINE = [[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]], [[0.05, -0.08, 0.03], [0.1, -0.16, 0.06]]


def motion(
    folder: Path, name: str, *, duration: object = 8.0, center: object = (0.1, -0.2), sine: object = SINE
) -> str:
    text = f"duration = {duration}\ncenter = {list(center)}\nsine = {sine}\ncosine = {COSINE}\n"  # pyright: ignore
    (folder / name).write_text(text)
    return name


def test_a_motion_is_read_as_it_stands(tmp_path):
    found = read_motion(motion(tmp_path, "a.toml"), tmp_path)
    assert found.duration == 8.0
    for values, expected in ((found.center, [0.1, -0.2]), (found.sine, SINE), (found.cosine, COSINE)):
        np.testing.assert_allclose(values, expected, atol=1e-12)  # put to rest, which they are to rounding


def test_a_motion_may_last_ten_minutes_and_no_longer(tmp_path):
    assert read_motion(motion(tmp_path, "a.toml", duration=LONGEST), tmp_path).duration == LONGEST
    with pytest.raises(ScenarioError, match=r"duration = 600\.001; expected up to 600 s"):
        read_motion(motion(tmp_path, "b.toml", duration=600.001), tmp_path)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_number_may_be_large_up_to_its_limit(tmp_path, sign):
    assert read_motion(motion(tmp_path, "a.toml", center=(sign * LARGEST, 0.5)), tmp_path).center[0] == sign * LARGEST
    with pytest.raises(ScenarioError, match="center contains a number that is not finite or beyond 10000"):
        read_motion(motion(tmp_path, "b.toml", center=(sign * LARGEST * 1.001, 0.5)), tmp_path)


def test_a_start_that_is_off_by_a_millionth_is_no_rest(tmp_path):
    for off, fine in ((1e-7, True), (1e-5, False)):
        sine = [[0.1 + off, 0.1, -0.1], SINE[1]]
        name = motion(tmp_path, f"{off}.toml", sine=sine)
        if fine:
            read_motion(name, tmp_path)
        else:
            with pytest.raises(ScenarioError, match=r"does not start at rest \(coefficients off by"):
                read_motion(name, tmp_path)


def test_motions_of_other_content_have_other_digests(tmp_path):
    digests = {motion_digest(motion(tmp_path, f"{k}.toml", duration=8.0 + k), tmp_path) for k in range(3)}
    assert len(digests) == 3
    assert all(len(digest) == 16 for digest in digests)
