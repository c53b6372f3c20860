"""The page of the repeated paper: whether its claims hold, gains and payload beside the published, figure 3."""

import math
from pathlib import Path

import numpy as np

import scenarios.paper.published as published
from ident.estimate import IdentifiedGain
from scenarios.paper.experiment import IDENTIFIED, PaperRun, run_paper
from scenarios.reports.content import Figure, Heading, Mood, Paragraph, Part, Report
from scenarios.reports.pages import provenance
from scenarios.reports.pages.fit_rows import FitRows
from scenarios.reports.pages.torque_plots import TOLD, torque_plot
from scenarios.reports.paper import paper_report
from scenarios.reports.plot import Axis, Plot, Reference, Tone, about, intervals
from scenarios.store.paper_folder import read_paper


def page(folder: Path) -> Report:
    """Everything that the folder tells; the experiment is repeated with the seed that it names.

    Raises:
        ForeignResult: If its document is damaged, or of another version.
        SimulationError: If a motion cannot be carried out.
    """
    saved = read_paper(folder)
    run = run_paper(saved.seed)
    told = paper_report(run)
    said = [part for part in told.parts if not isinstance(part, Figure)]
    parts: list[Part] = [said[-1]]
    if not same(saved.result, told.document):
        text = "Repeated now, the experiment gives other numbers than the folder holds; the page shows those of now."
        parts.append(Paragraph(text, Mood.BAD, strong=True))
    parts += [gain_plot(run), mass_plot(run), *said[:-1]]
    parts += [Heading("Figure 3: torques of case 2, measured and reconstructed"), Paragraph(TOLD), *figure_3(run)]
    about = {"Seed": str(saved.seed), "Versions": provenance.versions_in_words(saved.versions)}
    parts += provenance.repeated({"As it was made": saved.command}, about, {})
    return Report(told.title, tuple(parts), saved.result)


def same(there: object, here: object) -> bool:
    """Whether two JSON values are equal but for the rounding of another machine."""
    if isinstance(there, dict) and isinstance(here, dict):
        return there.keys() == here.keys() and all(same(there[key], here[key]) for key in here)
    if isinstance(there, list | tuple) and isinstance(here, list | tuple):
        return len(there) == len(here) and all(map(same, there, here))
    if isinstance(there, float) and isinstance(here, float):
        return math.isclose(there, here, rel_tol=1e-6, abs_tol=1e-9)
    return there == here


def gain_plot(run: PaperRun) -> Plot:
    """Gains as found here and as published, both about what was injected: the published ones."""
    names = tuple(str(joint) for joint in range(1, IDENTIFIED + 1))
    ours = [(str(j), gain) for j, gain in enumerate(run.gains.joints, 1) if isinstance(gain, IdentifiedGain)]
    ours = [(name, gain) for name, gain in ours if name in names]
    theirs = list(zip(published.GAINS, published.GAINS_2SIGMA, strict=True))
    return Plot(
        title="Drive gains, ours and the paper's",
        caption="Bars: two standard deviations, from the residual alone as in the paper.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="gain", unit="N m/unit"),
        series=(
            intervals(
                "ours", [name for name, _ in ours], [about(gain.value, 2.0 * gain.std) for _, gain in ours], Tone.FIRST
            ),
            intervals("the paper's", names, [about(*each) for each in theirs], Tone.SECOND),
        ),
    )


def mass_plot(run: PaperRun) -> Plot:
    """The payload's mass by the gains of each case."""
    names = tuple(f"case {k}" for k in range(1, len(run.cases) + 1))
    ours = [(case["M"].value, 2.0 * case["M"].std) for case in run.cases]
    theirs = [(case.M, case.M_2sigma) for case in published.CASES]
    return Plot(
        title="The payload's mass with the gains of each case",
        caption="Case 1: gains of 1. Case 2: identified gains. Case 3: these with 20 % error. Dashed: as weighed.",
        x=Axis(title="", categories=names),
        y=Axis(title="mass", unit="kg"),
        series=(
            intervals("ours", names, [about(*each) for each in ours], Tone.FIRST),
            intervals("the paper's", names, [about(*each) for each in theirs], Tone.SECOND),
        ),
        references=(Reference("", float(run.payloads[0][-1])),),
    )


def figure_3(run: PaperRun) -> list[Plot]:
    """Torques of joints 1 to 4, both motions one after the other."""
    case = run.cases[1]
    system, end = case.system, float(case.system.t.max())
    plots: list[Plot] = []
    for j in range(IDENTIFIED):
        own = np.flatnonzero(system.joint == j)
        own = own[np.lexsort((system.t[own], system.loaded[own]))]
        gain = float(case.gain[j])
        loaded = system.loaded[own].astype(np.intp)
        rows = FitRows(
            joint=j,
            scale=gain,
            unit="N m",
            turning=True,
            t=system.t[own] + end * loaded,
            stamp=system.t[own],
            V=system.V[own],
            residual=system.V[own] - case.torque[own] / gain,
            q=np.empty(0),
            dq=np.empty(0),
            motion=loaded,
            sigma=case.sigma,
            still=(),
        )
        plots.append(torque_plot(rows, ("bare flange", "7.025 kg"), (0.0, end)))
    return plots
