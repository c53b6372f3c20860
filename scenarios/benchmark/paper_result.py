"""The result of the repeated paper beside the published values: JSON, tables 2 to 4, figure 3, files and page."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from ident.model.parameters import INERTIAL
from ident.support.naming import one_line
from scenarios.rendering.content import NONE, Heading, Mood, Paragraph, Part, Report, column, number, sentence, table
from scenarios.rendering.result import ResultModel
from scenarios.results.fit import TORQUES, torque_plot
from scenarios.results.record import digests_of, read_result, repeated
from scenarios.support.errors import ScenarioError

PARAMETERS, ROWS, PAPER = "parameters.parquet", "rows.parquet", "paper.json"
FILES = (PARAMETERS, ROWS, PAPER)
IDENTIFIED = 4
"""Number of joints with identified gains, as in the paper."""
DRAWN = 2
"""The case of figure 3."""


@dataclass(frozen=True, slots=True)
class PublishedCase:
    """One case of tables 2 and 4: first moment [kg m], mass [kg] and norms of the residual."""

    MZ: float
    MZ_2sigma: float
    M: float
    M_2sigma: float
    error_norm: float
    rel_error_norm: float
    sigma: float


CASES = (
    PublishedCase(1.04, 0.0378, 6.71, 0.158, 77.28, 0.075643, 1.16293),
    PublishedCase(0.934, 0.0449, 7.17, 0.162, 76.11, 0.0744996, 1.14535),
    PublishedCase(0.867, 0.0453, 8.65, 0.198, 85.85, 0.0840385, 1.29288),
)
GAINS = (0.9401, 0.9619, 1.1148, 0.9146)
"""Table 3, joints 1 to 4 [N m / drive unit]."""
GAINS_2SIGMA = (0.0817, 0.0357, 0.0372, 0.0503)
ROWS_LESS_UNKNOWNS = 4416
"""(77.28 / 1.16293)^2, exactly."""
SECOND_MASS, SECOND_MASS_2SIGMA = 4.35, 0.150
"""The second payload of section V, weighed as 4.275 kg [kg]."""


class _Finite(ResultModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Claim(_Finite):
    """A claim of the paper.

    Attributes:
        claim: The claim.
        holds: Whether the simulated experiment confirms it.
    """

    claim: str
    holds: bool


class PaperGain(_Finite):
    """The drive gain of one joint by eq. 27.

    Attributes:
        joint: Number of the joint, from 1.
        true: Injected gain [N m / drive unit].
        estimate: Identified gain [N m / drive unit], null if refused.
        std: Standard deviation of the estimate, from the residual as in the paper [N m / drive unit].
        identifiable: Whether there is an estimate.
        reason: Why the joint is refused.
    """

    joint: int = Field(ge=1)
    true: float
    estimate: float | None
    std: float | None
    identifiable: bool
    reason: str | None


class PaperParameter(_Finite):
    """One of the ten standard parameters of a payload, in SI units.

    Attributes:
        parameter: Name of the parameter: XX to ZZ, MX, MY, MZ or M.
        true: True value of the mounted payload [kg m^2, kg m, kg].
        estimate: Estimate [kg m^2, kg m, kg].
        std: Standard deviation of the estimate, including that of the gains [kg m^2, kg m, kg].
        known: Whether its value was given to the identification.
        essential: Whether its relative standard deviation is under 10 %.
    """

    parameter: str
    true: float
    estimate: float
    std: float
    known: bool
    essential: bool


class PaperFit(_Finite):
    """Quality of the fit of a case (table 4).

    Attributes:
        method: `ols` or `wls`: whether each joint's rows are weighted by its own residual.
        rows: Number of rows of all joints and both motions.
        unknowns: Number of estimated parameters of arm and payload.
        error_norm: Norm of the residuals, each in standard deviations of its joint's residuals.
        rel_error_norm: Ratio of this norm to the norm of the torques, weighted in the same way.
        sigma: Standard deviation of the residuals, each in standard deviations of its joint's residuals.
    """

    method: str
    rows: int
    unknowns: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class PaperPayload(_Finite):
    """A payload identified with given gains.

    Attributes:
        gains: Gains of this case, one per joint [N m / drive unit].
        payload: Its ten parameters.
        fit: Quality of the fit.
        published: The values that the paper prints; the gains only with case 2.
    """

    gains: tuple[float, ...]
    payload: Annotated[tuple[PaperParameter, ...], Field(min_length=len(INERTIAL), max_length=len(INERTIAL))]
    fit: PaperFit
    published: dict[str, object]

    def __getitem__(self, name: str) -> PaperParameter:
        """Return the parameter of that name."""
        return self.payload[INERTIAL.index(name)]


class _Numbered(_Finite):
    case: int = Field(ge=1, description="Number of the case")


class PaperCase(PaperPayload, _Numbered):
    """One of the paper's three cases."""


class WrongGains(_Finite):
    """Payload and fit with gain errors of 20 %, relative to case 2.

    Attributes:
        signs: Signs of the gain errors of joints 1 to 4.
        M: Ratio of the estimated masses.
        MZ: Ratio of the first moments along the flange's axis.
        error_norm: Ratio of the relative error norms.
    """

    signs: str
    M: float
    MZ: float
    error_norm: float


class PaperResult(_Finite):
    """What `rx90 paper --json` prints.

    Attributes:
        gains: Drive gains of all joints, of which cases 2 and 3 use those of joints 1 to 4.
        cases: Cases 1, 2 and 3.
        patterns: Effect of each pattern of signs of the gain errors of case 3, relative to case 2.
        second_payload: The second payload, identified with the gains of case 2.
        checks: Claims of the paper.
        passed: Whether all claims hold.
    """

    gains: tuple[PaperGain, ...]
    cases: Annotated[tuple[PaperCase, ...], Field(min_length=3, max_length=3)]
    patterns: Annotated[tuple[WrongGains, ...], Field(min_length=16, max_length=16)]
    second_payload: PaperPayload
    checks: tuple[Claim, ...]
    passed: bool

    @staticmethod
    def title(seed: int) -> str:
        """Return the title of a report."""
        return f"Gautier and Briot (2011), section IV, on the simulated RX-90, seed {seed}"

    def parts(self) -> Iterable[Part]:
        """Verdict and claims, tables 2 to 4 beside the published numbers, and those of section V."""
        failed, count = sum(not check.holds for check in self.checks), len(self.checks)
        if failed:
            yield Paragraph(f"FAILED: {failed} of {count} claims do not hold.", Mood.BAD, strong=True)
        else:
            yield Paragraph(f"PASSED: all {count} claims hold.", Mood.GOOD, strong=True)
        for each in self.checks:
            yield Paragraph(f"holds: {each.claim}") if each.holds else Paragraph(f"FAILS: {each.claim}", Mood.BAD)
        pairs = list(zip(self.cases, CASES, strict=True))
        yield table(
            [
                (case.case, case[name], getattr(printed, name), getattr(printed, f"{name}_2sigma"))
                for case, printed in pairs
                for name in ("MZ", "M")
            ],
            column("Parameter", lambda row: f"case {row[0]} {row[1].parameter}", words=True),
            column("True", lambda row: f"{row[1].true:.3f}"),
            column("Ours", lambda row: f"{row[1].estimate:.3f}"),
            column("2 sigma", lambda row: f"{2 * row[1].std:.4f}"),
            column("Rel. sigma [%]", lambda row: f"{100 * row[1].std / abs(row[1].estimate):.1f}"),
            column("Paper", lambda row: f"{row[2]:.3f}"),
            column("Paper's\n2 sigma", lambda row: f"{row[3]:.4f}"),
            column("Paper's\nrel. sigma [%]", lambda row: f"{50 * row[3] / row[2]:.1f}"),
            title="Table 2: payload parameters with the gains of each case [kg m, kg]",
        )
        yield table(
            self.gains,
            column("Joint", lambda gain: f"joint {gain.joint}", words=True),
            column("Injected", lambda gain: f"{gain.true:.4f}"),
            column("Ours", lambda gain: "refused" if gain.estimate is None else f"{gain.estimate:.4f}"),
            column("2 sigma", lambda gain: NONE if gain.std is None else f"{2 * gain.std:.4f}"),
            column("Paper", lambda gain: _printed(GAINS, gain)),
            column("Paper's\n2 sigma", lambda gain: _printed(GAINS_2SIGMA, gain)),
            title="Table 3: identified drive gains [N m / drive unit]",
        )
        for gain in self.gains:
            if gain.reason is not None:
                yield Paragraph(sentence(f"Joint {gain.joint}: {gain.reason}"))
        yield table(
            pairs,
            column("Case", lambda pair: f"case {pair[0].case}", words=True),
            column("Norm", lambda pair: f"{pair[0].fit.error_norm:.2f}"),
            column("Relative", lambda pair: f"{pair[0].fit.rel_error_norm:.4f}"),
            column("Sigma", lambda pair: f"{pair[0].fit.sigma:.4f}"),
            column("r - b", lambda pair: pair[0].fit.rows - pair[0].fit.unknowns),
            column("Paper's\nnorm", lambda pair: f"{pair[1].error_norm:.2f}"),
            column("Paper's\nrelative", lambda pair: f"{pair[1].rel_error_norm:.4f}"),
            column("Paper's\nsigma", lambda pair: f"{pair[1].sigma:.4f}"),
            column("Paper's\nr - b", lambda pair: ROWS_LESS_UNKNOWNS),
            title="Table 4: error norm, relative norm, sigma, degrees of freedom; ours, then the paper's",
        )
        two, three = CASES[1:]
        norm = three.rel_error_norm / two.rel_error_norm
        theirs = WrongGains(signs="paper", M=three.M / two.M, MZ=three.MZ / two.MZ, error_norm=norm)
        yield table(
            [*sorted(self.patterns, key=lambda each: each.error_norm), theirs],
            column("Signs", lambda each: each.signs, words=True),
            column("M", lambda each: number(each.M, ".3f")),
            column("MZ", lambda each: number(each.MZ, ".3f")),
            column("Error norm", lambda each: number(each.error_norm, ".3f")),
            title="Errors of 20 % on the gains of joints 1 to 4, by their signs: ratios to case 2",
        )
        yield table(
            [self.second_payload["M"]],
            column("Parameter", lambda mass: mass.parameter, words=True),
            column("True", lambda mass: f"{mass.true:.3f}"),
            column("Ours", lambda mass: f"{mass.estimate:.3f}"),
            column("2 sigma", lambda mass: f"{2 * mass.std:.3f}"),
            column("Paper", lambda _: f"{SECOND_MASS:.3f}"),
            column("Paper's\n2 sigma", lambda _: f"{SECOND_MASS_2SIGMA:.3f}"),
            title="The second payload with the gains of case 2 [kg]",
        )


def _printed(values: tuple[float, ...], gain: PaperGain) -> str:
    return f"{values[gain.joint - 1]:.4f}" if gain.joint <= IDENTIFIED else NONE


class SavedPaper(BaseModel):
    """`paper.json`: the result of `rx90 paper`, provenance, and digests of the other files."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    format: Literal[1] = 1
    seed: int
    command: str
    versions: dict[str, str]
    files: dict[str, str] = {}
    result: dict[str, JsonValue]


def page(folder: Path) -> Report:
    """Return the page of a folder, only from its files.

    Raises:
        ScenarioError: If its document is damaged, or of another version; if the rows of figure 3 are missing, or others
            than were written with it.
    """
    path, rows = folder / PAPER, folder / ROWS
    saved = read_result(folder, SavedPaper, PAPER)
    try:
        found = PaperResult.model_validate(saved.result)
    except ValidationError as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        again = f"write it again: {one_line(saved.command)} --force"
        raise ScenarioError(f"{one_line(path)}: its result lacks data for the page: {first}; {again}") from error
    try:
        same = digests_of(folder, [ROWS])[ROWS] == saved.files.get(ROWS)
        torques = pd.read_parquet(rows).query(f"case == 'case {DRAWN}'") if same else None
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{one_line(rows)}: cannot be read: {error}") from error
    if torques is None:
        raise ScenarioError(f"{one_line(rows)}: is not the file that {PAPER} names; write it again")
    more: list[Part] = [Heading("Figure 3: torques of case 2, measured and reconstructed"), Paragraph(TORQUES)]
    end = float(torques["t"].to_numpy().max())
    for joint in range(IDENTIFIED):
        own = torques.query("joint == @joint + 1").sort_values(["loaded", "t"])
        t, measured, reconstructed = own[["t", "measured", "reconstructed"]].to_numpy(np.float64).T
        motion, starts = own["loaded"].to_numpy(np.intp), [("bare flange", 0.0), ("7.025 kg", end)]
        more.append(torque_plot(joint, "N m", t + end * motion, measured, measured - reconstructed, motion, starts))
    facts = {"Seed": str(saved.seed)}
    more += repeated({"Original command": saved.command}, facts, saved.versions, saved.files)
    return found.report(found.title(saved.seed), *more)
