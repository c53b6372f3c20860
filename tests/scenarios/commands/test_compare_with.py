from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from printed import printed
from weighed_cell import PLAIN, identified, off

from ident.diagnosis.diagnosis import two_digits
from ident.payload.payload import read_payload
from scenarios.cli import main
from scenarios.results.gains import Result
from scenarios.results.gains_file import read_gains
from scenarios.results.record import read_result

pytestmark = pytest.mark.usefixtures("_computed_once", "_all_undiagnosed")


def listed(cell: Path, factors: tuple[float, ...]) -> str:
    """The gains of a cell, some of them off, as words of a command line; 1 where there is none."""
    gains = read_gains(cell / "gains.toml").gains
    return ",".join(repr(factor * (each.estimate or 1.0)) for factor, each in zip(factors, gains, strict=True))


def test_gains_of_a_data_sheet_are_told_with_the_weight_that_they_make(weighed_cell, tmp_path, capsys):
    sheet = listed(weighed_cell, (1.0, 1.25, 0.8, 1.0, 1.0, 1.0))
    words = [*identified(weighed_cell), *PLAIN]
    result = printed(capsys, "result", [*words, "--compare-with", sheet, "--save", str(tmp_path / "saved")])
    cost = result["cost"]
    weight = read_payload(weighed_cell / "run" / "payload-heavy.toml")
    mass = cost["payload"][0]
    assert (mass["stated"], mass["true"], mass["found"], cost["passed"]) == (weight.mass, None, None, None)
    alone = [each["assumed_mass"] for each in cost["joints"]]
    # Joints 2 and 3 weigh by their own gains, to what their intervals, of some percent, leave.
    np.testing.assert_allclose(alone[1:3], weight.mass * np.array([1.25, 0.8]), rtol=0.03)
    for given, each, gain in zip(map(float, sheet.split(",")), cost["joints"], result["gains"], strict=True):
        assert each["gain"] == gain["estimate"]
        assert each["assumed_gain"] == given
        if gain["identifiable"]:
            assert each["rel_change"] == gain["estimate"] / given - 1.0
    assert read_result(tmp_path / "saved", Result).cost.model_dump(mode="json") == cost
    assert main([*words, "--compare-with", sheet]) == 0
    out = capsys.readouterr().out
    # By the joint with the narrowest interval.
    known = [each for each in result["gains"] if each["std"]]
    spread, best = min((2.0 * each["std"] / abs(each["estimate"]), each["joint"]) for each in known)
    said = f"joint {best} alone weighs the {weight.mass:.4g} kg to ±{two_digits(spread * weight.mass)} kg"
    assert said in " ".join(out.split())


def test_a_gains_file_says_the_same_as_its_numbers_and_its_deviations_count(weighed_cell, capsys):
    off(weighed_cell, 3, 1.2, "other.json")
    words = [*identified(weighed_cell), *PLAIN, "--json", "--compare-with"]
    assert main([*words, str(weighed_cell / "other.json")]) == 0
    by_file = printed(capsys, "result")["cost"]
    third = by_file["joints"][2]
    np.testing.assert_allclose(third["rel_change"], 1.0 / 1.2 - 1.0, rtol=1e-6)
    assert main([*words, listed(weighed_cell, (1.0, 1.0, 1.2, 1.0, 1.0, 1.0))]) == 0
    by_numbers = printed(capsys, "result")["cost"]
    np.testing.assert_allclose(third["assumed_mass"], by_numbers["joints"][2]["assumed_mass"], rtol=1e-2)
    assert third["assumed_mass_std"] > by_numbers["joints"][2]["assumed_mass_std"]


FAULTS = {
    "1,1,1": "--compare-with: 3 gains, but robot rx90 has 6 joints",
    "-1.2,1,1,1,1,1": "joint 1: -1.2, but its gain is",  # the first one negative: no option
    "0.9,0.9,1100,1,1,1": "joint 3: 1100 is ",
    "0.9,0.9,1.1,0.9,0.06,1": "check the unit, N m or N per unit of the logged current",
    "1,1,0,1,1,1": "joint 3: a gain of 0",
    "sheet": "'sheet': expected a file name that ends with .json or .toml, or numbers such as 12,12,10",
}


def test_gains_that_are_none_or_weigh_nothing_are_one_line(weighed_cell, capsys):
    for given, message in FAULTS.items():
        assert message in refused(capsys, [*identified(weighed_cell), "--compare-with", given])
    bare = [*identified(weighed_cell)[:5], "--compare-with", "1,1,1,1,1,1"]
    assert "--compare-with: bare recordings give only ratios of gains; add --loaded B" in refused(capsys, bare)
