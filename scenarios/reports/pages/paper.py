"""The page of the repeated paper: claims, gains and payload compared with the published ones, figure 3."""

from pathlib import Path

import numpy as np
import pandas as pd

import scenarios.benchmark.paper.published as published
from scenarios.benchmark.paper.experiment import IDENTIFIED
from scenarios.benchmark.paper.folder import read_paper, read_torques
from scenarios.benchmark.paper.result import PaperCase, PaperResult
from scenarios.rendering.content import Figure, Heading, Paragraph, Part, Report
from scenarios.rendering.plot import Axis, Plot, Reference, Tone, about, intervals
from scenarios.reports.paper import paper_report
from scenarios.results import provenance
from scenarios.results.fit_plots import TORQUES, torque_plot
from scenarios.results.fit_rows import FitRows

DRAWN = 2
"""The case of figure 3."""


def page(folder: Path) -> Report:
    """Return the page of a folder, only from its files.

    Raises:
        ScenarioError: If its document is damaged, or of another version; if the rows of figure 3 are missing, or others
            than were written with it.
    """
    saved, found = read_paper(folder)
    torques = read_torques(folder, saved, DRAWN)
    told = paper_report(found, torques, saved.seed)
    (figure,) = (part for part in told.parts if isinstance(part, Figure))
    verdict, *said = (part for part in told.parts if part is not figure)
    tables, claims = said[: -len(found.checks)], said[-len(found.checks) :]
    parts: list[Part] = [verdict, *claims, gain_plot(found), mass_plot(found), *tables]
    parts += [Heading(figure.caption), Paragraph(TORQUES), *figure_3(torques, found.cases[DRAWN - 1])]
    about = {"Seed": str(saved.seed), "Versions": provenance.versions_in_words(saved.versions)}
    parts += provenance.repeated({"Original command": saved.command}, about, saved.files)
    return Report(told.title, tuple(parts), told.document)


def gain_plot(found: PaperResult) -> Plot:
    """Return the plot of our and of the published gains, relative to the injected ones."""
    names = tuple(str(joint) for joint in range(1, IDENTIFIED + 1))
    ours = {
        str(gain.joint): about(gain.estimate, 2.0 * gain.std)
        for gain in found.gains[:IDENTIFIED]
        if gain.estimate is not None and gain.std is not None
    }
    theirs = list(zip(published.GAINS, published.GAINS_2SIGMA, strict=True))
    return Plot(
        title="Drive gains, ours and the paper's",
        caption="Bars: two standard deviations, from the residual alone as in the paper.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="gain", unit="N m/unit"),
        series=(
            intervals("Ours", list(ours), list(ours.values()), Tone.FIRST),
            intervals("The paper's", names, [about(*each) for each in theirs], Tone.SECOND),
        ),
    )


def mass_plot(found: PaperResult) -> Plot:
    """Return the plot of the payload's mass with the gains of each case."""
    names = tuple(f"case {k}" for k in range(1, len(found.cases) + 1))
    ours = [(case["M"].estimate, 2.0 * case["M"].std) for case in found.cases]
    theirs = [(case.M, case.M_2sigma) for case in published.CASES]
    return Plot(
        title="The payload's mass with the gains of each case",
        caption=(
            "Case 1: all gains 1. Case 2: identified gains. Case 3: identified gains with errors of 20 %, "
            "- + + - on joints 1 to 4. Dashed: "
            "weighed mass."
        ),
        x=Axis(title="", categories=names),
        y=Axis(title="mass", unit="kg"),
        series=(
            intervals("Ours", names, [about(*each) for each in ours], Tone.FIRST),
            intervals("The paper's", names, [about(*each) for each in theirs], Tone.SECOND),
        ),
        references=(Reference("", found.cases[0]["M"].true),),
    )


def figure_3(torques: pd.DataFrame, case: PaperCase) -> list[Plot]:
    """Return the plots of torques of joints 1 to 4, both motions in sequence."""
    end = float(torques["t"].to_numpy().max())
    plots: list[Plot] = []
    for j in range(IDENTIFIED):
        own = torques.query("joint == @j + 1").sort_values(["loaded", "t"])
        t, measured, reconstructed = own[["t", "measured", "reconstructed"]].to_numpy(np.float64).T
        gain, loaded = case.gains[j], own["loaded"].to_numpy(np.intp)
        rows = FitRows(
            joint=j,
            scale=gain,
            unit="N m",
            turning=True,
            t=t + end * loaded,
            stamp=t,
            V=measured / gain,
            residual=(measured - reconstructed) / gain,
            q=np.empty(0),
            dq=np.empty(0),
            motion=loaded,
            sigma=case.fit.sigma,
            still=(),
        )
        plots.append(torque_plot(rows, ("bare flange", "7.025 kg"), (0.0, end)))
    return plots
