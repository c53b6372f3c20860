"""Folders of every kind that a page is made of, small ones: a motion of 6 s, gains joint by joint."""

import shlex
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
from method_rows import told
from quick import RANDOM as QUICK
from quick import quick_scenario, two_sources
from rich.console import Console
from undiagnosed import undiagnosed

from scenarios.benchmark.comparison import Comparison, compared
from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import Study, carry_out, monte_carlo, sensitivity
from scenarios.experiments.workers import Workers

NAME = "<script>window.pwned=1<&script>\"'`"
"""A name of a scenario that is no HTML."""
RANDOM = QUICK.partition("[random.load]")[0]
"""Gains drawn."""


def scenario(folder: Path, more: str = "") -> str:
    """A scenario whose name and description are no HTML."""
    path = quick_scenario(folder, more)
    text = path.read_text()
    named = folder / f"{NAME}.toml"
    named.write_text('description = """<img src=x onerror="window.pwned=2">"""\n' + text)
    return str(named)


def run(folder: Path) -> Path:
    """A run; joints 4 and 6 are refused."""
    main(["run", scenario(folder), "--seed", "5", "--save", str(folder / "saved")])
    return folder / "saved"


def logs(saved: Path) -> list[str]:
    return [str(saved / "unloaded.parquet"), str(saved / "loaded.parquet")]


def identification(folder: Path, saved: Path, *more: str) -> Path:
    """Its recordings identified as logs of a real robot would be."""
    unloaded, loaded = logs(saved)
    words = ["--model", str(saved / "robot.xml"), "--unloaded", unloaded, "--loaded", loaded]
    words += ["--payload", str(saved / "payload.toml"), "--method", "ls-2011", "--cutoff-hz", "14"]
    main(["identify", *words, *more, "--save", str(folder)])
    return folder


def check(folder: Path, saved: Path, *more: str) -> Path:
    """A recording checked, and asked whether it would show a payload; `more` words may name further ones."""
    words = [logs(saved)[0], *more, "--payload", str(saved / "payload.toml")]
    main(["check", "rx90", *words, "--save", str(folder)])
    return folder


def study(folder: Path) -> Path:
    """Six trials, gains drawn."""
    named = scenario(folder, RANDOM)
    return _carried_out(
        monte_carlo(load_scenario(named), 6, 11), folder / "mc", ["monte-carlo", named, "-n", "6", "--seed", "11"]
    )


def budget(folder: Path) -> Path:
    """An error budget of two sources, of the smallest design that has Sobol indices."""
    quick_scenario(folder)  # for its motion
    named = two_sources(folder, "short.toml")
    found = sensitivity(load_scenario(str(named)), repeats=2, samples=4, seed=0)
    return _carried_out(found, folder / "budget", ["sensitivity", str(named)])


def _carried_out(found: Study, folder: Path, words: list[str]) -> Path:
    """A study in this process: workers of their own take seconds to import what is here."""
    here = Workers(open=lambda: ThreadPoolExecutor(1), count=lambda: 1)
    command = shlex.join(["rx90", *words, "--out", str(folder)])
    with undiagnosed():
        carry_out(found, folder, here, command=command, console=Console(quiet=True))
    return folder


def comparison(folder: Path) -> Path:
    """What a comparison of two methods leaves, its gains made up: off by 1.2 and 3.4 % times the joint."""
    folder.mkdir()
    sizes = {NAME: 0.012, "theirs": 0.034}
    made = (
        told(name, *({"trial": 0, "joint": j, "estimate": 2.0 + 2.0 * off * j, "std": 0.1} for j in (1, 2, 3)))
        for name, off in sizes.items()
    )
    found = compared(NAME, pd.concat(made), list(sizes))
    about = {"Command": f"rx90 compare '{NAME}'", "Date": "2011-09-25"}
    (folder / "report.json").write_text(Comparison(about=about, scenarios=[found]).model_dump_json())
    return folder
