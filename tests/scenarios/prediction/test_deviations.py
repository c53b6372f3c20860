import numpy as np
import pytest
from robot_folders import robot_folder

from ident.model.arm import load_arm
from ident.model.parameters import STANDARD
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload
from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND, ArmModel, Carried, MotionRows, predicted
from sim.plant import PayloadBody, Plant
from sim.robot import read_robot
from sim.trajectory import at_rest

INERTIA = (0.021, 0.034, 0.028, 0.002, -0.003, 0.004)
RATE = 13.0
PRIOR = 1.0
"""Deviation of ln g beforehand."""
# Normal matrices square the condition of the columns, some 1e4 here, and pseudo-inverses drop none.
SQUARED = 1e-6


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> tuple[Structure, MotionRows]:
    robot = read_robot(robot_folder(tmp_path_factory.mktemp("arm"), 3))
    structure = structure_of(load_arm(robot.model))
    body = PayloadBody(mass=2.9, com=(0.11, -0.07, 0.13), inertia=INERTIA)
    model = ArmModel.of(Plant(robot=robot, drives=robot.drives, payload=body), structure)
    rng = np.random.default_rng(3)
    motion = at_rest(np.array([0.3, -0.6, 0.8]), *rng.normal(0.0, 0.35, (2, 3, 4)), 7.0)
    return structure, model.rows(motion(np.arange(0.0, 7.0, 1.0 / RATE)), RATE)


STDS = {"mass_std": 0.05, "com_std": (0.002, 0.003, 0.001), "inertia_std": (1e-3, 2e-3, 3e-3, 4e-4, 5e-4, 6e-4)}
KNOWN = pytest.mark.parametrize("known", ["all", "com", "mass"])


def carried(known: str) -> Carried:
    return Carried.nominal(Payload(mass=2.9, com=(0.11, -0.07, 0.13), inertia=INERTIA, known=known, **STDS))


def sigma(rows: MotionRows, chi: np.ndarray) -> np.ndarray:
    both = np.concatenate([rows.bare, rows.bare + rows.Y @ chi])
    return RESIDUAL * np.sqrt((both**2).mean(axis=0)) * np.sqrt(RATE / ROWS_PER_SECOND)


def own(rows: MotionRows, j: int, name: str) -> np.ndarray:
    return rows.W[:, j, len(STANDARD) * j + STANDARD.index(name)]


def joint_rows(rows: MotionRows, structure: Structure, what: Carried, j: int) -> np.ndarray:
    """Columns of joint j, bare above loaded, written out: phi of both motions, offset, arm, unknown payload, ln g."""
    shared = [c for c in structure.base.columns if STANDARD[c % len(STANDARD)] not in ("Fv", "Fc", "off")]
    friction, A = np.stack([own(rows, j, "Fv"), own(rows, j, "Fc")], axis=1), rows.W[:, j, shared]
    U, torque, offset = rows.Y[:, j][:, ~what.known.mask], rows.rigid[:, j], own(rows, j, "off")[:, None]
    none = np.zeros_like(friction)
    bare = np.concatenate([friction, none, offset, A, np.zeros_like(U), torque[:, None]], axis=1)
    loaded = np.concatenate([none, friction, offset, A, U, (torque + rows.Y[:, j] @ what.chi)[:, None]], axis=1)
    return np.concatenate([bare, loaded])


def written_out(rows: MotionRows, structure: Structure, what: Carried) -> tuple[np.ndarray, np.ndarray]:
    """Both deviations from one matrix with every unknown of every joint, and a row for what is known of each gain."""
    n, s = rows.bare.shape[1], sigma(rows, what.chi)
    blocks = [joint_rows(rows, structure, what, j) / s[j] for j in range(n)]
    common = blocks[0].shape[1] - 6
    system = np.zeros((sum(map(len, blocks)) + n, 5 * n + common + n))
    error, row = np.zeros((len(system), what.known.spread.shape[1])), 0
    for j, block in enumerate(blocks):
        part = slice(row, row + len(block))
        system[part, 5 * j : 5 * j + 5] = block[:, :5]
        system[part, 5 * n : 5 * n + common] = block[:, 5:-1]
        system[part, 5 * n + common + j] = block[:, -1]
        half = len(block) // 2
        error[row + half : row + 2 * half] = rows.Y[:, j] @ what.known.spread / s[j]
        row += len(block)
    system[row:, -n:] = np.eye(n) / PRIOR
    inverse = np.linalg.pinv(system, rcond=1e-12)[-n:]
    return np.linalg.norm(inverse, axis=1), np.linalg.norm(inverse @ error, axis=1)


@KNOWN
def test_all_joints_at_once_are_the_least_squares_of_every_unknown_written_out(arm, known):
    (structure, rows), what = arm, carried(known)
    found = predicted(rows, structure, "nls")(what)
    noise, share = written_out(rows, structure, what)
    np.testing.assert_allclose(found.noise, noise, rtol=SQUARED)
    np.testing.assert_allclose(found.payload, share, rtol=SQUARED)
    np.testing.assert_allclose(found.total, np.sqrt(noise**2 + share**2), rtol=SQUARED)


@KNOWN
def test_joint_by_joint_is_equation_27_written_out(arm, known):
    (structure, rows), what = arm, carried(known)
    found = predicted(rows, structure, "ls-2011")(what)
    s = sigma(rows, what.chi)
    for j, columns in enumerate(structure.joint_independent):
        W, Y, mask = rows.W[:, j, structure.base.columns[columns]], rows.Y[:, j], what.known.mask
        system = np.block([[W, np.zeros((len(W), 10 - mask.sum()))], [W, Y[:, ~mask]]])
        y = np.concatenate([np.zeros(len(W)), Y[:, mask] @ what.chi[mask]])
        left = y - system @ np.linalg.pinv(system, rcond=1e-9) @ y
        noise = 1.0 / np.sqrt(1.0 / PRIOR**2 + left @ left / s[j] ** 2)
        np.testing.assert_allclose(found.noise[j], noise, rtol=SQUARED)
        error = np.concatenate([0.0 * Y @ what.known.spread, Y @ what.known.spread])
        np.testing.assert_allclose(found.payload[j], noise**2 * np.linalg.norm(left @ error) / s[j] ** 2, rtol=SQUARED)
