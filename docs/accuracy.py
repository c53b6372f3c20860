"""Writes the tables of accuracy.md: error against physics step, and what leaving out velocity reversals gains."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.identification import identify
from ident.observation.observation import ObserveOptions
from ident.preparation import SIMULATED
from ident.recordings.recording import Recording
from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.run import as_identified
from sim.record import record
from sim.sensors import SensorOptions, noise_streams

STEPS_MS = (1.0, 0.5, 0.25, 0.125)
SHARES = (0.0, 0.05, 0.1, 0.2, 0.3)


def recordings(setup: Setup, step: float, sensors: SensorOptions) -> tuple[Recording, Recording]:
    experiments = [replace(e, step=step, sensors=sensors) for e in setup.experiments]
    unloaded, loaded = record(experiments, [noise_streams(np.random.default_rng(i)) for i in range(2)], threads=2)
    return unloaded, loaded


def estimate(
    setup: Setup, pair: tuple[Recording, Recording], observing: ObserveOptions, *, method: str = "ls-2011"
) -> GainEstimate:
    return identify(
        setup.structure,
        as_identified(setup, pair),
        method=method,
        observing=observing,
        policy=SIMULATED,
    ).estimate


def row(label: str, setup: Setup, found: GainEstimate) -> str:
    errors = [
        f"{joint.value / true - 1:+.1e}" if isinstance(joint, IdentifiedGain) else "refused"
        for joint, true in zip(found.joints, setup.true_gain, strict=True)
    ]
    return f"| {label} | {' | '.join(errors)} | {found.rel_error_norm:.1e} | {found.rows} |"


def written(text: str, title: str, rows: list[str]) -> str:
    """The page with the rows of the table whose first column has a title."""
    head = rf"(\| {re.escape(title)} \|[^\n]*\n[|-]+\n)"
    assert re.search(head, text), f"accuracy.md has no table {title}"
    return re.sub(rf"{head}(?:\|[^\n]*\n)*", lambda found: found[1] + "\n".join(rows) + "\n", text)


def main() -> None:
    ideal, nominal = setup_of(load_scenario("ideal")), setup_of(load_scenario("nominal"))
    page = Path(__file__).with_name("accuracy.md")
    text = page.read_text(encoding="utf-8")
    pairs = {step: recordings(ideal, 1e-3 * step, SensorOptions()) for step in STEPS_MS}
    for delay_ms in (0.0, 0.5):
        observing = ObserveOptions(current_delay=1e-3 * delay_ms, reversal_speed=0.2)
        rows = [row(f"{step:g}", ideal, estimate(ideal, pair, observing)) for step, pair in pairs.items()]
        text = written(text, f"ideal, currents taken {delay_ms:g} ms late, step [ms]", rows)
    late = ObserveOptions(current_delay=5e-4)
    rows = [row(f"{step:g}", ideal, estimate(ideal, pair, late, method="nls")) for step, pair in pairs.items()]
    text = written(text, "ideal by nls, currents taken 0.5 ms late, step [ms]", rows)
    pair = recordings(nominal, 1e-3, SensorOptions())
    by_share = {share: estimate(nominal, pair, ObserveOptions(reversal_speed=share)) for share in SHARES}
    rows = [row(f"{share:g}", nominal, found) for share, found in by_share.items()]
    page.write_text(written(text, "nominal without noise, share", rows), encoding="utf-8")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
