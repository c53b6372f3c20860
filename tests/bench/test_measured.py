import re

import numpy as np
import pytest
from places import ROOT

from bench.measured import BEGIN, DOCS, END, TABLES, budget, faults_of
from ident.payload.payload import Payload
from ident.recordings.recording import Motion, Recording


def block(name: str) -> str:
    """The table of a name, as its page has it."""
    text = (DOCS / TABLES[name][0]).read_text(encoding="utf-8")
    return text.partition(BEGIN.format(name))[2].partition(END)[0].strip()


def rows(name: str) -> list[list[str]]:
    return [line.strip("| ").split(" | ") for line in block(name).splitlines()[2:]]


def percents(*numbers: float) -> str:
    return f"{min(numbers):.2f} to {max(numbers):.2f} %"


def test_every_table_that_is_measured_has_its_place_and_is_there():
    places = {
        (path.name, name)
        for path in DOCS.rglob("*.md")
        for name in re.findall(BEGIN.format("(.*)"), path.read_text(encoding="utf-8"))
    }
    assert places == {(place, name) for name, (place, _) in TABLES.items()}
    assert all(rows(name) for name in TABLES)


def test_sentences_state_what_the_measured_tables_have():
    accuracy, budgets = ((DOCS / f"{name}.md").read_text(encoding="utf-8") for name in ("accuracy", "error-budget"))
    (_, _, nominal, held, width), (*_, constant, _), (_, _, field, *_), _ = rows("coverage")
    assert f"| noise | {nominal} % |" in accuracy
    assert f"noise | {field} % |" in accuracy
    coverage = (DOCS / "coverage.md").read_text(encoding="utf-8")
    assert (held, f"gain in {constant} %" in coverage) == ("100", True)
    assert f"sigma of {width} times" in coverage
    counts = [[int(cell) for cell in cells[1:]] for cells in rows("faults")]
    assert counts[0] == [0, 0, sum(counts[0]), 0]
    named, _, silent, harmful = (sum(each) for each in zip(*counts[1:], strict=True))
    said = f"Of {sum(map(sum, counts[1:]))} faults put into logs of three arms {named} are named"
    told = (DOCS / "diagnosis.md").read_text(encoding="utf-8")
    assert re.search(rf"{said}.*\s{silent} are silent and change no gain by 3 sigma, and {harmful} is silent", told)
    assert re.search(r"the errors are half a per\s+cent", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert 0.4 <= float(nominal.split(" to ")[-1]) < 0.65
    others = [float(cells[3]) for cells in rows("robots") if cells[0] != "nominal"]
    assert f"{len(others)} other arms, simulated | noise | {percents(*others)}, the worst joint" in accuracy
    for name in ("nominal", "field"):
        whole = [float(cell.strip("*")) for cell in rows(name)[0][1:]]
        assert re.search(rf"{percents(*whole)} on\s+`{name}`", budgets)


def test_faults_are_put_where_they_are_said_to_be(rng):
    t, q, v = 0.25 * np.arange(9.0), rng.standard_normal((9, 5)), rng.standard_normal((9, 5))
    payload = Payload(mass=2.3, com=(0.01, -0.03, 0.2), inertia=(0.02, 0.03, 0.04, 0.0, 0.0, 0.0))
    logs = [Motion(Recording(t, q, v, "a")), Motion(Recording(t, 2.0 * q, 3.0 * v, "b"), payload)]
    found = {what: both for what, (_, both) in faults_of(logs).items()}
    a, b = (each.recording for each in found["zero of q4 off by 2 degrees in one log"])
    np.testing.assert_array_equal(a.q, q)
    np.testing.assert_allclose(b.q - 2.0 * q, [[0.0, 0.0, 0.0, np.pi / 90.0, 0.0]] * 9, rtol=0, atol=1e-15)
    a, b = (each.recording for each in found["v2 times 1.05 in one log"])
    np.testing.assert_allclose((a.v / v, b.v / v), ([[1.0] * 5] * 9, [[3.0, 3.15, 3.0, 3.0, 3.0]] * 9), rtol=1e-14)
    np.testing.assert_allclose(found["q5 times 1.02"][1].recording.q[:, 3:] / q[:, 3:], [[2.0, 2.04]] * 9, rtol=1e-14)
    np.testing.assert_array_equal(found["currents late by 6 samples"][0].recording.v[6:], v[:3])
    np.testing.assert_allclose(found["clock 5 % off"][0].recording.t, 1.05 * t, rtol=1e-15)
    assert found["payload 20 mm aside"][1].payload.com == pytest.approx((0.03, -0.03, 0.2), rel=1e-12)
    swapped = found["logs exchanged"]
    assert (swapped[0].payload, swapped[1].payload) == (None, payload)
    np.testing.assert_array_equal(swapped[0].recording.v, 3.0 * v)


@pytest.mark.slow
def test_the_budget_of_nominal_is_that_of_today():
    assert block("nominal") == budget("nominal")
