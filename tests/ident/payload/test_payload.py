import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import INERTIAL_ORDER
from refusals import refused

from ident.payload.payload import (
    FARTHEST,
    HEAVIEST,
    LIGHTEST,
    Payload,
    payload_from_table,
    read_payload,
    standard_parameters,
    write_payload,
)
from ident.support.errors import PayloadError


def test_standard_parameters_are_pinocchio_s():
    body = pin.Inertia.Random()
    J = body.inertia
    ours = standard_parameters(body.mass, body.lever, (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]))
    np.testing.assert_allclose(ours, body.toDynamicParameters()[INERTIAL_ORDER], rtol=1e-13, atol=1e-14)


def test_files_keep_every_digit(tmp_path):
    payload = Payload(
        mass=1 / 3,
        mass_std=0.01,
        com=(0.1, -0.2 / 3, 0.3),
        com_std=(1e-3, 2e-3, 3e-3),
        inertia=(0.02, 0.03, 0.04, 1e-3 / 3, 2e-3, -1e-3),
        known="mass",
    )
    write_payload(payload, tmp_path / "p.toml")
    assert read_payload(tmp_path / "p.toml") == payload
    write_payload(Payload(mass=2.0, known="mass"), tmp_path / "m.toml")
    assert read_payload(tmp_path / "m.toml") == Payload(mass=2.0, known="mass")


INERTIA = "inertia = { ixx = 1, iyy = 1, izz = 1, ixy = 0, ixz = 0, iyz = 0 }"
FAULTS = {
    "": "the file is empty",
    "known = 'mass'": "mass is missing; without it gains and payload are known up to a common factor",
    "mass = 'heavy'": "mass = 'heavy': expected a finite number",
    "mass = -1\nknown = 'mass'": "mass = -1 kg; expected a positive number",
    "mass = 1\nknown = 'some'": "known = 'some': expected one of 'all', 'com', 'mass', 'none'",
    "mass = 1\nweight = 2": "unknown key 'weight'; known: mass",
    "mass = 1": "known = 'all' but com is missing; add it, or set known = 'mass'",
    f"mass = 1\ncom = [0, 0, 0]\n{INERTIA.replace('1,', '0.02,').replace('izz = 0.02', 'izz = 0.07')}": (
        r"triangle inequality: .* 0\.02 \+ 0\.02 < 0\.07"
    ),
    f"mass = 1\ncom = [0, 0, 0]\n{INERTIA.replace('ixx = 1', 'ixx = -1')}": "smallest principal moment is -1",
    f"mass = 1\ncom = [0, 0, 0]\n{INERTIA.replace('ixx = 1, ', '')}": r"inertia\.ixx is missing; ixx, iyy and izz",
    f"mass = 1\ncom = [0, 0, 0]\n{INERTIA.replace('izz', 'zz')}": r"inertia: unknown key 'zz'; did you mean 'izz'\?",
    f"mass = {'9' * 5000}": "not TOML: Exceeds the limit",
    "mass = 2\nknown = 'mass'\ncom_std = [1, 1, 1]": "com_std is given, but com is missing",
}


def test_a_faulty_payload_is_one_line_that_names_file_and_fault(tmp_path):
    path = tmp_path / "payload.toml"
    for text, message in FAULTS.items():
        path.write_text(text)
        assert str(refused(PayloadError, message, read_payload, path)).startswith(str(path))
    refused(PayloadError, r"absent\.toml: no such file", read_payload, tmp_path / "absent.toml")


def body(mass: float = 2.5, **changes) -> Payload:
    plain = {"com": (0.1, 0.2, 0.3), "inertia": (0.02, 0.03, 0.04, 1e-3, -2e-3, 3e-3)}
    return Payload(mass=mass, **(plain | changes))


TINY = (2e-6, 3e-6, 4e-6, 1e-7, -2e-7, 3e-7)
LIMITS = {
    "mass = 0.000999 kg; expected": ({"mass": LIGHTEST, "inertia": TINY}, {"mass": 0.999e-3, "inertia": TINY}),
    "mass = 2000.1 kg; expected": ({"mass": HEAVIEST}, {"mass": 2000.1}),
    r"com = \[0.1, -5.01, 0.2\] is more than 5 m from": ({"com": (0.1, -FARTHEST, 0.2)}, {"com": (0.1, -5.01, 0.2)}),
    "mass_std = 2.51; expected 0 to 2.5": ({"mass_std": 2.5}, {"mass_std": 2.51}),
    "mass_std = -1e-09; expected 0": ({"mass_std": 0.0}, {"mass_std": -1e-9}),
    r"com_std = .*5.01.*; expected 0 to 5;": ({"com_std": (0.1, FARTHEST, 0.2)}, {"com_std": (0.1, 5.01, 0.2)}),
    r"com_std = .*-0.01.*; expected 0 to 5;": ({"com_std": (0.1, 0.0, 0.2)}, {"com_std": (0.1, -0.01, 0.2)}),
    r"inertia_std = .*; expected 0 to 62.5;": (
        {"inertia_std": (0.0, 0.0, 0.0, 62.5, 0.0, 0.0)},
        {"inertia_std": (0.0, 0.0, 0.0, 62.6, 0.0, 0.0)},
    ),
}


@pytest.mark.parametrize("message", LIMITS)
def test_values_are_taken_up_to_their_limits(message):
    inside, outside = LIMITS[message]
    body(**inside)
    refused(PayloadError, message, body, **outside)


def test_an_inertia_in_a_file_is_refused_from_the_radius_of_gyration_that_no_payload_has():
    for mass, most, name in ((6.25, 0.725, "izz"), (0.25, 0.425, "iyy")):  # 0.35 m + 0.15 m sqrt(mass / kg)
        inside, outside = (
            {"mass": mass, "known": "mass", "inertia": {"ixx": 0.7 * J, "iyy": 0.6 * J, "izz": 0.5 * J} | {name: J}}
            for J in (mass * (0.99 * most) ** 2, mass * (1.01 * most) ** 2)
        )
        payload_from_table(inside)
        refused(PayloadError, rf"inertia\.{name} = .* expected {most:.3g} m at most", payload_from_table, outside)


def test_products_of_inertia_that_are_left_out_are_zero():
    table = {"mass": 2.5, "com": [0.1, 0.2, 0.3], "com_std": [0.4, 0.5, 0.6]}
    table["inertia"] = {"izz": 0.04, "ixx": 0.02, "iyy": 0.03, "ixz": 0.001}
    found = payload_from_table(table | {"inertia_std": {"ixx": 1, "iyy": 2, "izz": 3}})
    assert found.inertia == (0.02, 0.03, 0.04, 0.0, 0.001, 0.0)
    assert found.inertia_std == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
    assert found.com_std == (0.4, 0.5, 0.6)


def test_mass_and_centre_are_known_with_their_own_deviations_alone():
    payload = Payload(mass=3.4, com=(-0.06, 0.09, 0.05), mass_std=0.02, com_std=(0.001, 0.003, 0.002), known="com")
    known = payload.known_part()
    assert known.names == ("MX", "MY", "MZ", "M")
    np.testing.assert_allclose(known.chi[6:], [-0.204, 0.306, 0.17, 3.4], rtol=1e-12)
    # d(m c) = c dm + m dc, of independent dm and dc; nothing is said of the inertia.
    expected = np.zeros((10, 10))
    for k in range(3):
        expected[6 + k, 0], expected[6 + k, 1 + k] = payload.com[k] * 0.02, 3.4 * payload.com_std[k]
    expected[9, 0] = 0.02
    np.testing.assert_allclose(known.spread, expected, rtol=0, atol=1e-12)  # differences of polynomials
