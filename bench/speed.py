"""Time and memory, printed as figures and ratios; run by `make bench`. Machines differ: quote the ratios.

Every figure is the median of several runs; ratios are taken run by run, the two sides in turn.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from threadpoolctl import threadpool_limits

import rx90_mjcf
from ident.identification import identify
from ident.model.arm import load_pinocchio
from ident.model.regressor import regressor_blocks
from ident.preparation import DOUBTED, SIMULATED, Policy
from ident.recordings.recording import Motion
from scenarios.experiments.run import Trial, run, simulate
from scenarios.experiments.scenario import load_scenario, setup_of, with_method
from scenarios.experiments.trials import Task, run_task, trial_schema
from scenarios.prediction.budget import predicted_budget
from sim.effects import ModelErrors
from sim.engine import Engine, Simulation, acting, varies
from sim.plant import Plant, plant_model, resting
from sim.record import record
from sim.sensors import noise_streams

RUNS, PERIODS = 5, 400
SCENARIOS = ("nominal", "field", "panda")
BATCHES = {1: 3, 8: 3, 32: 1}
"""Trials at once, and how often."""
COMPLIANCE = (1e-5, 1e-5, 3e-5, 4e-5, 6e-5, 1.2e-4)
EFFECTS = {
    "no effect, again": ModelErrors(),
    "tilted base": ModelErrors(base_tilt_x=0.01),
    "moved frames": ModelErrors(d3_error=0.001),
    "drift": ModelErrors(coulomb_drift=0.02),
    "gravity spring": ModelErrors(gravity_spring=2e3),
    "wrist coupling": ModelErrors(wrist_coupling=1.0),
    "elastic joints": ModelErrors(joint_compliance=COMPLIANCE),
    "elastic joints with backlash": ModelErrors(joint_compliance=COMPLIANCE, backlash=3e-4),
    "Stribeck friction": ModelErrors(stribeck=0.2),
    "friction by direction": ModelErrors(viscous_by_direction=0.1),
    "load friction, motor torque": ModelErrors(load_friction=0.05),
    "load friction, transmitted torque": ModelErrors(transmitted_friction=0.05),
    "temperature": ModelErrors(motor_warming=200.0, viscous_by_temperature=-0.01),
    "curve of viscous friction": ModelErrors(viscous_curve=0.5),
    "cogging and ripple": ModelErrors(cogging=0.003, torque_ripple=0.02),
    "presliding": ModelErrors(presliding=3e-4),
}


def seconds(action: Callable[[], object]) -> float:
    """Wall time of one call [s]."""
    started = time.perf_counter()
    action()
    return time.perf_counter() - started


def medians(*actions: Callable[[], object], runs: int = RUNS) -> list[list[float]]:
    """Times of each action, taken in turn after one warm-up."""
    for action in actions:
        action()
    return [list(times) for times in zip(*[[seconds(action) for action in actions] for _ in range(runs)], strict=True)]


def regressor_speed() -> None:
    """Vectorised regressor against Pinocchio called sample by sample."""
    setup = setup_of(load_scenario("nominal"))
    arm, rng = setup.structure.arm, np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-2, 2, (3, 20_000, arm.n))
    model = load_pinocchio(rx90_mjcf.MJCF)
    data = model.createData()

    def ours() -> None:
        for _ in regressor_blocks(arm, q, dq, ddq):
            pass

    def theirs() -> None:
        for k in range(2000):
            pin.computeJointTorqueRegressor(model, data, q[k], dq[k], ddq[k])

    a, b = medians(ours, theirs)
    per_sample = [1e6 * t / len(q) for t in a], [1e6 * t / 2000 for t in b]
    print(
        f"regressor, 6 joints: {statistics.median(per_sample[0]):.2f} us a sample (best {min(per_sample[0]):.2f}); ",
        end="",
    )
    ratio = statistics.median(y / x for x, y in zip(*per_sample, strict=True))
    print(f"Pinocchio in a Python loop takes {ratio:.1f} times as long")


def identification_speed() -> None:
    """Identification of the nominal pair, recordings in memory."""
    setup = setup_of(load_scenario("nominal"))
    logs = simulate(setup, 0).logs
    chosen = setup.scenario.table.identification

    def action(policy: Policy) -> None:
        identify(
            setup.structure,
            logs,
            method=chosen.method,
            observing=chosen.observe,
            gains=chosen.gains,
            policy=policy,
        )

    times, checks = medians(lambda: action(SIMULATED), lambda: action(DOUBTED))
    samples = sum(len(each.recording.t) for each in logs)
    print(f"identification of the pair ({samples} samples): {statistics.median(times):.3f} s (best {min(times):.3f})")
    print(f"the same with every doubt about the logs: {statistics.median(checks):.3f} s (best {min(checks):.3f})")


LONG, MANY = 16, 6


def growth() -> None:
    """Identification of longer logs, and of more of them, over that of the nominal pair; with every doubt."""
    setup = setup_of(load_scenario("nominal"))
    chosen = setup.scenario.table.identification
    pairs = [simulate(setup, seed).logs for seed in range(MANY)]
    _, loaded = pairs[0]
    many = [replace(each, payload=each.payload and loaded.payload) for pair in pairs for each in pair]
    stretched = [
        replace(m, trajectory=replace(m.trajectory, duration=LONG * m.trajectory.duration)) for m in setup.experiments
    ]
    long = simulate(replace(setup, experiments=tuple(stretched)), 0).logs

    def action(logs: Sequence[Motion], method: str = chosen.method) -> Callable[[], object]:
        return lambda: identify(
            setup.structure, logs, method=method, observing=chosen.observe, gains=chosen.gains, policy=DOUBTED
        )

    for what, logs in ((f"logs {LONG} times as long", long), (f"{MANY} times as many logs", many)):
        for method in (chosen.method, "ls-2011"):
            before, after = medians(action(pairs[0], method), action(logs, method), runs=2)
            ratio = statistics.median(y / x for x, y in zip(before, after, strict=True))
            print(f"{what}, {method}: {ratio:.1f} times the time of the pair ({statistics.median(before):.2f} s)")


def closed_loop_ratio(simulations: int) -> None:
    """Closed loop with controller, sensors and logging over bare stepping of as many steps, two threads each."""
    setup = setup_of(load_scenario("nominal"))
    motion = replace(setup.experiments[0].trajectory, duration=4.0)
    slow = replace(motion, sine=0.05 * motion.sine, cosine=0.05 * motion.cosine)
    experiments = [replace(setup.experiments[i % 2], trajectory=slow) for i in range(simulations)]
    step = experiments[0].step
    bare, loaded = (plant_model(experiments[0].plant, loaded=x, step=step) for x in (False, True))
    periods, substeps = 4001, round(1e-3 / step)

    def closed() -> None:
        record(experiments, [noise_streams(np.random.default_rng(i)) for i in range(simulations)], threads=2)

    def stepping() -> None:
        models = [loaded if i % 2 else bare for i in range(simulations)]
        engine = Engine([Simulation(model=m, start=slow.center) for m in models], substeps=substeps, threads=2)
        for _ in range(periods):
            engine.advance()

    a, b = medians(closed, stepping)
    ratio = statistics.median(x / y for x, y in zip(a, b, strict=True))
    each = 1e6 * statistics.median(b) / (periods * substeps * simulations)
    print(f"closed loop over bare stepping, {simulations:3d} simulations: {ratio:.2f} (bare: {each:.2f} us a step)")


def processor_s(action: Callable[[], object], times: int = RUNS) -> float:
    spent = []
    for _ in range(times):
        started = time.process_time()
        action()
        spent.append(time.process_time() - started)
    return statistics.median(spent)


def runs_and_trials(name: str) -> None:
    """Of one scenario, recording and identification together, and identification alone."""
    scenario = load_scenario(name)
    setup, schema = setup_of(scenario), trial_schema(scenario, (), ())
    first = run(setup, 0)  # imports, tables
    one = processor_s(lambda: run(setup, 1))
    print(f"{name}, {len(first.estimate.joints)} joints: a run takes {one:.2f} s; a trial", end="")
    for size, times in BATCHES.items():
        batch = tuple(Trial(number=k, seed=k) for k in range(size))
        whole = processor_s(lambda batch=batch: run_task(Task(scenario, batch, schema)), times)
        print(f"{' ' if size == 1 else ', '}{whole / size:.2f} s in a batch of {size}", end="")
    print()


def predictions(method: str) -> None:
    scenario = with_method(load_scenario("nominal"), method, [])
    first = processor_s(lambda: predicted_budget(scenario), 1)
    again = processor_s(lambda: predicted_budget(scenario))
    print(f"prediction for nominal, {method}: {first:.2f} s, again {again:.2f} s")


def engine_with(errors: ModelErrors, simulations: int) -> Engine:
    """Simulations of one plant at rest, each with a model of its own."""
    first = setup_of(load_scenario("nominal")).experiments[0]
    plant = Plant(robot=first.plant.robot, drives=first.plant.drives, payload=first.plant.payload, errors=errors)
    entries: list[Simulation] = []
    for _ in range(simulations):
        model = plant_model(plant, loaded=True, step=1e-3)
        acts = acting(plant, model, step=1e-3, earlier=0) if varies(errors) else None
        entries.append(Simulation(model=model, start=resting(plant, model, first.trajectory.center), varied=acts))
    return Engine(entries, substeps=1, threads=1)


def effects(simulations: int) -> None:
    """A physics step with each model error over one without any, taken in turn."""

    def time_of(errors: ModelErrors) -> float:
        engine = engine_with(errors, simulations)
        engine.current[:] = 2.0
        return seconds(lambda: [engine.advance() for _ in range(PERIODS)])

    for name, errors in EFFECTS.items():
        ratios = [time_of(errors) / time_of(ModelErrors()) for _ in range(RUNS)]
        print(
            f"{name}, {simulations} simulations: {statistics.median(ratios):.2f} of plain "
            f"({min(ratios):.2f} to {max(ratios):.2f})"
        )


if __name__ == "__main__":
    with threadpool_limits(1):
        regressor_speed()
        identification_speed()
        growth()
        for method in ("ls-2011", "nls"):
            predictions(method)
        for name in SCENARIOS:
            runs_and_trials(name)
        for count in (1, 2, 32, 128):
            closed_loop_ratio(count)
        for count in (1, 32):
            effects(count)
