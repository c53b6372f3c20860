"""Deviations of a payload that a scenario states count, whatever it inherits."""

from pathlib import Path

import pytest

from ident.payload.payload import Payload
from scenarios.experiments.scenario import believed_payloads, load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.support.errors import UnknownName, WrongValue

INERTIA = "inertia = { ixx = 0.021, iyy = 0.034, izz = 0.019 }"
SURE = f"payload = {{ mass = 6.3, com = [0.08, 0.03, 0.11], {INERTIA} }}"
DEVIATION = {
    "mass_std": "mass_std = 0.02",
    "com_std": "com_std = [0.0, 0.003, 0.0]",
    "inertia_std": "inertia_std = { ixx = 0.0, iyy = 0.0, izz = 0.002 }",
}


def weighed(deviation: str) -> str:
    return SURE.removesuffix(" }") + f", {deviation} }}"


def written(folder: Path, **files: str) -> str:
    for name, text in files.items():
        (folder / f"{name}.toml").write_text(text)
    return str(folder / f"{name}.toml")


def believed(path: str, name: str = "loaded") -> Payload:
    return believed_payloads(load_scenario(path))[name]


def stds(payload: Payload) -> tuple[float, ...]:
    return payload.mass_std, *payload.com_std, *payload.inertia_std


@pytest.mark.parametrize("key", DEVIATION)
def test_a_deviation_that_is_stated_counts_over_an_exact_that_is_inherited(tmp_path, key):
    path = written(tmp_path, mine=f'extends = "nominal"\n[belief]\n{weighed(DEVIATION[key])}\n')
    expected = {"mass_std": 0.02, "com_std": (0.0, 0.003, 0.0), "inertia_std": (0.0, 0.0, 0.002, 0.0, 0.0, 0.0)}
    assert getattr(believed(path), key) == expected[key]
    told = setup_of(load_scenario(path)).payloads
    assert [getattr(each, key) for each in told.values()] == [expected[key]]


def test_an_exact_that_is_inherited_holds_for_a_payload_without_deviations_and_for_a_shipped_one(tmp_path):
    zeros = written(tmp_path, sure=f'extends = "nominal"\n[belief]\n{weighed("mass_std = 0.0")}\n')
    shipped = written(tmp_path, shipped='extends = "nominal"\n[belief]\npayload = "offset"\n')
    assert not any(stds(believed(zeros)) + stds(believed(shipped)))


def test_an_exact_that_a_later_file_states_takes_deviations_back(tmp_path):
    first = f'extends = "nominal"\n[belief]\n{weighed("mass_std = 0.02")}\n'
    path = written(tmp_path, first=first, second='extends = "first.toml"\n[belief]\nexact = true\n')
    assert stds(believed(path)) == (0.0,) * 10


def test_deviations_of_one_payload_leave_the_others_exact(tmp_path):
    bodies = f'[plant]\npayloads = {{ heavy = "offset", light = {{ {SURE.removeprefix("payload = {")} }}\n'
    both = '[experiment]\nprotocol = ["bare", "heavy", "light"]\n'
    base = f'extends = "nominal"\n{both}{bodies}\n[belief]\npayloads = {{ heavy = "offset", light = "offset" }}\n'
    light = weighed("mass_std = 0.02").removeprefix("payload = ")
    path = written(tmp_path, two=base, mine=f'extends = "two.toml"\n[belief.payloads]\nlight = {light}\n')
    assert (believed(path, "light").mass_std, believed(path, "heavy").mass_std) == (0.02, 0.0)


@pytest.mark.parametrize("exact", ["true", "{ loaded = true }"])
def test_a_deviation_beside_an_exact_of_its_own_file_is_refused_by_name(tmp_path, exact):
    path = written(
        tmp_path, mine=f'extends = "nominal"\n[belief]\nexact = {exact}\n{weighed("com_std = [0, 0, 0.001]")}\n'
    )
    with pytest.raises(
        WrongValue, match=r"mine\.toml: belief\.payload: com_std is specified, but belief\.exact sets it"
    ):
        load_scenario(path)


def test_exact_of_a_payload_that_is_none_is_refused(tmp_path):
    path = written(tmp_path, mine='extends = "nominal"\n[belief]\nexact = { loadde = true }\n')
    with pytest.raises(UnknownName, match=r"belief\.exact: no payload 'loadde'; did you mean 'loaded'\?"):
        load_scenario(path)


def test_an_exact_by_name_holds_for_the_payloads_that_it_says_so_of_and_zeros_are_no_deviations(tmp_path):
    bodies = f'[plant]\npayloads = {{ heavy = "offset", light = {{ {SURE.removeprefix("payload = {")} }}\n'
    heavy, zero = weighed("mass_std = 0.02").removeprefix("payload = "), weighed("com_std = [0.0, 0.0, 0.0]")
    belief = (
        f"[belief]\nexact = {{ light = true, heavy = false }}\npayloads = {{ heavy = {heavy}, light = {zero[10:]} }}\n"
    )
    protocol = '[experiment]\nprotocol = ["bare", "heavy", "light"]\n'
    path = written(tmp_path, mine=f'extends = "nominal"\n{protocol}{bodies}{belief}')
    assert (believed(path, "light").mass_std, believed(path, "heavy").mass_std) == (0.0, 0.02)
