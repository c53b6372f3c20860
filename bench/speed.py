"""Time and memory by phase, of this tree beside a named commit, as one page; run by `make bench BASE=COMMIT`.

A phase runs in a process of its own, of either tree in turn, with one thread. A ratio is that of one round; its median
and range over the rounds are on the page, `out/bench.html` and `.md`. Machines differ: quote the ratios.
"""

import json
import os
import statistics
import subprocess
import sys
import tarfile
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT, OUT = Path(__file__).parents[1], Path("out")
ROUNDS, SLOWER = 3, 1.1
"""Rounds, and the ratio that the least of all rounds must exceed to be called slower."""
SAMPLES, SIMULATIONS, PERIODS, LONG = 500_000, 32, 400, 8
CELL = "--unloaded cell/unloaded.parquet --loaded cell/loaded.parquet --payload cell/payload.toml"
COMMANDS = {
    "imports alone": "-c 'import numpy, scipy.linalg, pinocchio, pyarrow.parquet'",
    "rx90 list": "-m scenarios list",
    "rx90 identify": f"-m scenarios identify --model rx90 {CELL} --quiet",
    "rx90 check": f"-m scenarios check rx90 {CELL.removeprefix('--unloaded ')} --quiet",
    "rx90 run nominal": "-m scenarios run nominal --quiet",
    "rx90 predict nominal": "-m scenarios predict nominal --quiet",
}
"""Fresh processes, of which CPU time and peak memory are measured; `rx90 run nominal --save cell` wrote `cell`."""


def seconds(*actions: Callable[[], object], times: int = 5) -> list[float]:
    """Least wall time of each action, taken in turn after one call of each [s]."""
    found = list[list[float]]()
    for _ in range(times + 1):
        found.append([])
        for action in actions:
            started = time.perf_counter()
            action()
            found[-1].append(time.perf_counter() - started)
    return [min(each) for each in zip(*found[1:], strict=True)]


def read() -> dict[str, float]:
    """Half a million samples of six joints, in two formats, and the checks of any recording."""
    import numpy as np
    import pandas as pd

    from ident.recordings.checks import check_log
    from ident.recordings.files import read_log

    t = 1e-3 * np.arange(SAMPLES)
    q = np.sin(t[:, None] * np.arange(1, 7)) + 1e-4 * np.random.default_rng(0).standard_normal((SAMPLES, 6))
    names = ["t", *(f"{kind}{j}" for kind in "qv" for j in range(1, 7))]
    data, found = pd.DataFrame(np.column_stack((t, q, np.cos(q))), columns=names), dict[str, float]()
    data.to_parquet("log.parquet")
    data.round(6).to_csv("log.csv", index=False)
    for file in ("log.parquet", "log.csv"):
        (found[file],) = seconds(lambda file=file: read_log(Path(file), check=None), times=2)
    log = read_log(Path("log.parquet"), check=None).recording
    return found | {"checks of a recording": seconds(lambda: check_log(log), times=2)[0]}


def identify() -> dict[str, float]:
    """The nominal pair: regressor, observation, identification by two methods, with doubts, of longer logs."""
    import numpy as np

    from ident.identification import identify
    from ident.model.regressor import regressor_blocks
    from ident.observation.observation import observe
    from ident.preparation import DOUBTED, SIMULATED
    from scenarios.experiments.run import simulate
    from scenarios.experiments.scenario import load_scenario, setup_of

    setup = setup_of(load_scenario("nominal"))
    logs, observing = simulate(setup, 0).logs, setup.scenario.table.identification.observe
    longer = [
        replace(each, trajectory=replace(each.trajectory, duration=LONG * each.trajectory.duration))
        for each in setup.experiments
    ]
    long = simulate(replace(setup, experiments=tuple(longer)), 0).logs
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 20_000, setup.structure.arm.n))

    def found(logs: Sequence[object], policy: object, method: str = "nls") -> float:
        action = partial(identify, setup.structure, logs, method=method, observing=observing, policy=policy)
        return seconds(action, times=3)[0]

    regress = partial(deque, maxlen=0)  # which keeps no block
    regressor, observation = seconds(
        lambda: regress(regressor_blocks(setup.structure.arm, *q)),
        lambda: observe(logs[1].recording, setup.structure, observing),
    )
    return {
        "regressor, 20 000 samples": regressor,
        "observation of a motion": observation,
        "ls-2011 without doubts": found(logs, SIMULATED, "ls-2011"),
        "nls without doubts": found(logs, SIMULATED),
        "nls": found(logs, DOUBTED),
        f"nls, logs {LONG} times as long": found(long, DOUBTED),
    }


def simulate() -> dict[str, float]:
    """A closed loop over bare stepping, and a step with each of some model errors over one without."""
    import numpy as np

    from scenarios.experiments.scenario import load_scenario, setup_of
    from sim.effects import ModelErrors
    from sim.engine import Engine, Simulation, acting, varies
    from sim.plant import Plant, plant_model, resting
    from sim.record import record
    from sim.sensors import noise_streams

    first = setup_of(load_scenario("nominal")).experiments[0]
    motion = replace(
        first.trajectory, duration=4.0, sine=0.05 * first.trajectory.sine, cosine=0.0 * first.trajectory.cosine
    )
    experiments, step = [replace(first, trajectory=motion)] * SIMULATIONS, first.step

    def engine(errors: ModelErrors) -> Engine:
        plant = Plant(robot=first.plant.robot, drives=first.plant.drives, payload=first.plant.payload, errors=errors)
        each = list[Simulation]()
        for _ in range(SIMULATIONS):
            model = plant_model(plant, loaded=True, step=step)
            acts = acting(plant, model, step=step, earlier=0) if varies(errors) else None
            each.append(Simulation(model=model, start=resting(plant, model, first.trajectory.center), varied=acts))
        return Engine(each, substeps=1, threads=1)

    def advancing(errors: ModelErrors) -> Callable[[], object]:
        stepped = engine(errors)
        stepped.current[:] = 2.0
        return lambda: [stepped.advance() for _ in range(PERIODS)]

    streams = [noise_streams(np.random.default_rng(i)) for i in range(SIMULATIONS)]
    each, closed = seconds(advancing(ModelErrors()), lambda: record(experiments, streams, threads=1), times=2)
    bare = each / PERIODS
    effects = {
        "elastic joints": ModelErrors(joint_compliance=(1e-5, 1e-5, 3e-5, 4e-5, 6e-5, 1.2e-4)),
        "Stribeck friction": ModelErrors(stribeck=0.2),
        "load friction": ModelErrors(load_friction=0.05),
        "cogging and ripple": ModelErrors(cogging=0.003, torque_ripple=0.02),
    }
    ratios = dict[str, float]()
    for name, errors in effects.items():
        plain, affected = seconds(advancing(ModelErrors()), advancing(errors))
        ratios[f"{name}, over none [-]"] = affected / plain
    over = closed / round(motion.duration / step) / bare
    return {"bare step [us]": 1e6 * bare / SIMULATIONS, "closed loop over bare steps [-]": over} | ratios


def study() -> dict[str, float]:
    """Trials of scenarios in a batch, one of them, and on two processes at once."""
    from concurrent.futures import wait

    from scenarios.experiments.run import Trial
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.trials import Task, run_task, trial_schema
    from scenarios.experiments.workers import local_processes

    def task(name: str, size: int) -> Task:
        scenario = load_scenario(name)
        return Task(scenario, tuple(Trial(number=k, seed=k) for k in range(size)), trial_schema(scenario, (), ()))

    found = dict[str, float]()
    for name, n in (("nominal", 1), ("nominal", 8), ("field", 2), ("panda", 2)):
        found[f"{name}, each of {n} trials"] = seconds(partial(run_task, task(name, n)), times=1)[0] / n
    with local_processes(2) as both:
        pool, each = both.open(), task("nominal", 8)
        (two,) = seconds(lambda: wait([pool.submit(run_task, each) for _ in range(2)]), times=1)
    return found | {"nominal, each of 16 trials on two processes": two / 16}


PHASES = {each.__name__: each for each in (read, identify, simulate, study)}


def measured(tree: Path, folder: Path) -> dict[str, float]:
    """All figures of a tree, by phase and name; a phase that this tree cannot run has none."""
    found = dict[str, float]()
    environment = os.environ | {"PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    for name in PHASES:
        command = [sys.executable, __file__, "--phase", name]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        figures = json.loads(done.stdout) if done.returncode == 0 else {}
        found |= {f"{name}: {key if key.endswith(']') else f'{key} [s]'}": value for key, value in figures.items()}
    for name, words in COMMANDS.items():
        started = subprocess.Popen(
            f"exec {sys.executable} {words}", cwd=folder, env=environment, shell=True, stdout=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(started.pid, 0)
        started.returncode = os.waitstatus_to_exitcode(status)
        if started.returncode in (0, 1):
            found[f"command: {name} [s of CPU]"] = usage.ru_utime + usage.ru_stime
            found[f"command: {name} [MB]"] = usage.ru_maxrss / 1024.0
    return found


def page(base: str, rounds: Sequence[tuple[Mapping[str, float], Mapping[str, float]]]) -> object:
    """The report of rounds, each of this tree and of the base: what became slower, then every figure."""
    from scenarios.rendering.content import Cell, Mood, Paragraph, Report, column, table
    from scenarios.rendering.wording import many

    ratios = {name: [here[name] / there[name] for here, there in rounds if name in here and name in there]
              for name in rounds[0][0]}  # fmt: skip
    slower = [name for name, each in ratios.items() if each and min(each) > SLOWER]

    def middle(k: int, name: str) -> str:
        found = [each[k][name] for each in rounds if name in each[k]]
        return f"{statistics.median(found):.3g}" if found else "-"

    def change(name: str) -> Cell:
        each = ratios[name]
        text = f"{statistics.median(each):.2f} ({min(each):.2f} to {max(each):.2f})" if each else "-"
        return Cell(text, Mood.BAD if name in slower else Mood.PLAIN)

    limit = f"{100 * (SLOWER - 1):.0f} %"
    said = f"Slower than at {base} by more than {limit} in every round: {', '.join(slower) or 'nothing'}."
    shown = table(
        ratios,
        column("Phase", lambda name: name.partition(": ")[0], words=True),
        column("Figure", lambda name: name.partition(": ")[2], words=True),
        column("Here", lambda name: middle(0, name)),
        column(base, lambda name: middle(1, name)),
        column("Ratio", change),
    )
    verdict = Paragraph(said, Mood.BAD if slower else Mood.GOOD, strong=True)
    return Report(
        f"Time and memory beside {base}, {many(len(rounds), 'round')}", (verdict, shown), {"rounds": list(rounds)}
    )


def main(words: Sequence[str]) -> None:
    """Measure one phase for the calling process, or all of both trees."""
    if words[:1] == ["--phase"]:
        print(json.dumps(PHASES[words[1]]()))
        return
    base = words[0] if words else "HEAD"
    name = subprocess.check_output(["git", "rev-parse", "--short", base], cwd=ROOT, text=True).strip()
    with TemporaryDirectory() as scratch:
        there, folder = Path(scratch) / "tree", Path(scratch) / "files"
        folder.mkdir()
        with tarfile.open(fileobj=BytesIO(subprocess.check_output(["git", "archive", name], cwd=ROOT))) as archive:
            archive.extractall(there, filter="data")
        run = [sys.executable, "-m", "scenarios", "run", "nominal", "--save", str(folder / "cell"), "--quiet"]
        subprocess.run(run, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
        rounds = [(measured(ROOT, folder), measured(there, folder)) for _ in range(ROUNDS)]
    from scenarios.rendering import Page, renderer, write_report

    report = page(name, rounds)
    OUT.mkdir(exist_ok=True)
    for ending in (".md", ".html", ".json"):
        write_report(report, OUT / f"bench{ending}")
    print(renderer("text")(report, Page(width=120)))


if __name__ == "__main__":
    main(sys.argv[1:])
