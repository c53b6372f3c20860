import numpy as np
import pytest
from drive_states import DQ, DRIVES, TURNS, Q, V
from plants import nominal_plant

from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep
from sim.effects.motors import warmed, warming


def step(**changes) -> ControlStep:
    """A control period of one simulation with a coupled motor."""
    constant = np.array([[26.0, 30.0, 16.0, 9.0, 7.0, 1.5, 2.5]])
    values = {
        "t": 0.31,
        "period": 0.002,
        "q": Q[None],
        "dq": DQ[None],
        "v": V[None],
        "constant": constant,
        "speed": (TURNS @ DQ)[None],
        "friction": constant.copy(),
        "damping": np.array([[31.0, 32.0, 12.0, 8.0, 5.5, 0.3, 2.4]]),
        "torque": np.full((1, 6), 0.75),
        "turns": TURNS[None],
        "transmitted": np.array([[5.0, -130.0, 41.0, -7.0, 3.0, 0.6]]),
        "warmth": np.array([[3.0, 21.0, 14.0, 0.5, 8.0, 33.0]]),
    }
    return ControlStep(**{**values, **changes})


def after(name: str, errors: ModelErrors, periods: int = 1, **changes) -> ControlStep:
    """What one effect makes of a period, the last of some."""
    plant = nominal_plant()
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    assert EFFECTS[name].varies(errors)
    term = EFFECTS[name].term([errors], [build])
    for _ in range(periods):
        done = step(**changes)
        term(done)
    return done


def changed(done: ControlStep) -> set[str]:
    """Which of the arrays that an effect may change are others."""
    plain = step()
    return {
        name
        for name in ("friction", "damping", "torque", "warmth")
        if not np.array_equal(getattr(done, name), getattr(plain, name))
    }


def test_gears_carry_the_torque_of_the_links_and_the_other_friction():
    done = after("load_friction", ModelErrors(gear_friction=0.09))
    plain, own = step(), slice(len(DRIVES.gain))
    speed = plain.speed[:, own]
    carried = plain.transmitted + plain.friction[:, own] * np.sign(speed) + plain.damping[:, own] * speed
    assert changed(done) == {"friction"}
    np.testing.assert_allclose((done.friction - plain.friction)[:, own], 0.09 * np.abs(carried), rtol=0, atol=1e-13)
    np.testing.assert_array_equal(done.friction[:, own.stop :], plain.friction[:, own.stop :])


def test_a_drive_wired_backwards_cogs_like_any_other():
    plant = nominal_plant(gain=np.array([-0.9, 1.1, -1.3, 0.8, 0.7, 1.2]))
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    done = step()
    EFFECTS["cogging"].term([ModelErrors(cogging=0.003, motor_waves=430.0)], [build])(done)
    expected = 0.75 - 0.003 * np.abs(plant.drives.gain) * plant.drives.current_limit * np.sin(430.0 * Q)
    np.testing.assert_allclose(done.torque[0], expected, rtol=1e-12)  # as above


@pytest.mark.parametrize("power", [1.0 / 3.0, 2.0])
def test_a_share_of_viscous_friction_follows_another_power_of_the_speed(power):
    errors = ModelErrors(viscous_curve=0.4, viscous_power=power, viscous_speed=0.7)
    done, plain = after("viscous_curve", errors), step()
    assert changed(done) == {"friction", "damping"}
    speed = np.abs(TURNS @ DQ)
    resisting = done.friction[0] + done.damping[0] * speed  # both against the motion
    expected = plain.damping[0] * (0.6 * speed + 0.4 * 0.7 * (speed / 0.7) ** power)
    np.testing.assert_allclose(resisting, plain.friction[0] + expected, rtol=1e-14)  # some roundings
    np.testing.assert_allclose(done.damping, 0.6 * plain.damping, rtol=1e-15)
    default = after("viscous_curve", ModelErrors(viscous_curve=0.4))
    np.testing.assert_allclose(
        default.friction[0], plain.friction[0] + 0.4 * plain.damping[0] * np.cbrt(speed), rtol=1e-14
    )


def test_warmth_along_a_motion_is_that_of_its_periods_one_after_the_other(rng):
    errors, load = ModelErrors(motor_warming=170.0, warming_time=1.7), rng.uniform(0.05, 0.7, (5, 3))
    before = np.array([31.0, 2.0, 7.0])
    expected = [before]
    for each in load:
        expected.append(warmed(errors, expected[-1], each, 0.3))
    np.testing.assert_allclose(warming(errors, before, load, 0.3), expected, rtol=1e-13)  # some roundings


def test_simulations_without_an_effect_are_left_alone_by_those_that_have_it():
    plant = nominal_plant()
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    strong = ModelErrors(
        load_friction=0.1,
        transmitted_friction=0.1,
        cogging=0.01,
        torque_ripple=0.01,
        viscous_curve=0.4,
        presliding=0.01,
        motor_warming=300.0,
        coulomb_by_temperature=-0.01,
    )
    both = step()
    doubled = {
        name: np.repeat(getattr(both, name), 2, axis=0)
        for name in ("q", "dq", "v", "constant", "speed", "friction", "damping", "torque", "turns", "transmitted")
    }
    for name in ("load_friction", "cogging", "viscous_curve", "presliding", "temperature"):
        done = step(**{key: x.copy() for key, x in doubled.items()}, warmth=np.zeros((2, 6)))
        term = EFFECTS[name].term([ModelErrors(), strong], [build, build])
        for _ in range(3):
            term(done)
        for key in ("friction", "damping", "torque"):
            np.testing.assert_array_equal(getattr(done, key)[0], doubled[key][0])
        assert not done.warmth[0].any()
        assert any(not np.array_equal(getattr(done, key)[1], doubled[key][1]) for key in ("friction", "torque"))
