"""Gautier and Briot (2011), section IV, on the simulated robot: cases 1 to 3 and the second payload.

    case 1   assumed gains, all 1
    case 2   gains of joints 1 to 4 identified (eq. 27), joints 5 and 6 left at 1 as in the paper
    case 3   those of case 2 with 20 % error on joints 1 to 4: -20 %, +20 %, +20 %, -20 %

each followed by the identification of the payload (eq. 25), then a payload of 4.275 kg with the gains of case 2.

The paper does not state the signs of its errors. Case 3 uses the one of sixteen patterns that changes mass, first
moment and error norm in the same directions as in the paper.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field

import rx90_mjcf
from ident.estimation.estimate import IdentifiedGain
from ident.estimation.joint_by_joint import joint_by_joint_gains
from ident.estimation.problem import Columns, ObservedMotion, pair
from ident.model.parameters import INERTIAL
from ident.observation.observation import observe
from ident.parameters.payload import PaperEstimate, payload_as_in_paper
from ident.payload.payload import read_payload, standard_parameters
from scenarios.benchmark.methods import AnswerGain
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.experiments.scenario_files import LOADED
from scenarios.experiments.schema import body_of
from scenarios.rendering.content import Heading, Mood, Paragraph, Part, Report, Table, column, table
from scenarios.rendering.result import ResultModel, to_json
from scenarios.rendering.wording import NONE, sentence
from scenarios.results.fit import TORQUES, torque_plot
from scenarios.results.record import check_files, digests_of, read_result, repeated
from scenarios.support.digests import with_digest
from scenarios.support.progress import SILENT, Progress
from scenarios.support.versions import versions
from sim.experiment import Experiment
from sim.record import record
from sim.sensors import noise_streams

ROWS, PAPER = "rows.parquet", "paper.json"
FILES = (ROWS, PAPER)
IDENTIFIED = 4
"""Number of joints with identified gains, as in the paper."""
DRAWN = 2
"""The case of figure 3."""
GAIN_ERRORS = (-0.2, 0.2, 0.2, -0.2)
"""Relative errors of the gains of joints 1 to 4 in case 3."""


class PublishedCase(NamedTuple):
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
    """A claim of the paper."""

    claim: str  # the claim
    holds: bool  # whether the simulated experiment confirms it


class PaperGain(AnswerGain):
    """The drive gain of one joint by eq. 27, with its standard deviation from the residual as in the paper."""

    true: float  # injected gain [N m / drive unit]


class PaperParameter(_Finite):
    """One of the ten standard parameters of a payload, in SI units."""

    parameter: str  # name of the parameter: XX to ZZ, MX, MY, MZ or M
    true: float  # true value of the mounted payload [kg m^2, kg m, kg]
    estimate: float  # estimate [kg m^2, kg m, kg]
    std: float  # standard deviation of the estimate, including that of the gains [kg m^2, kg m, kg]
    essential: bool  # whether its relative standard deviation is under 10 %


class PaperFit(_Finite):
    """Quality of the fit of a case (table 4), with the rows of each joint weighted by its own residual."""

    rows: int  # number of rows of all joints and both motions
    unknowns: int  # number of estimated parameters of arm and payload
    error_norm: float  # norm of the residuals, each in standard deviations of its joint's residuals
    rel_error_norm: float  # ratio of this norm to the norm of the torques, weighted in the same way
    sigma: float  # standard deviation of the residuals, each in standard deviations of its joint's residuals


class PaperPayload(_Finite):
    """A payload identified with given gains."""

    gains: tuple[float, ...]  # gains of this case, one per joint [N m / drive unit]
    payload: tuple[PaperParameter, ...] = Field(min_length=len(INERTIAL), max_length=len(INERTIAL))  # its parameters
    fit: PaperFit  # quality of the fit

    def __getitem__(self, name: str) -> PaperParameter:
        """Return the parameter of that name."""
        return self.payload[INERTIAL.index(name)]


class PaperResult(_Finite):
    """What `rx90 paper --json` prints."""

    gains: tuple[PaperGain, ...]  # drive gains of all joints, of which cases 2 and 3 use those of joints 1 to 4
    cases: tuple[PaperPayload, ...] = Field(min_length=3, max_length=3)  # cases 1, 2 and 3
    second_payload: PaperPayload  # the second payload, identified with the gains of case 2
    checks: tuple[Claim, ...]  # claims of the paper
    passed: bool  # whether all claims hold

    @staticmethod
    def title(seed: int) -> str:
        """Return the title of a report."""
        return f"Gautier and Briot (2011), section IV, on the simulated RX-90, seed {seed}"

    def parts(self) -> Iterable[Part]:
        """Verdict and claims, tables 2 to 4 beside the published numbers, and those of section V."""
        failed, count = sum(not check.holds for check in self.checks), len(self.checks)
        verdict = f"FAILED: {failed} of {count} claims do not hold." if failed else f"PASSED: all {count} claims hold."
        yield Paragraph(verdict, Mood.BAD if failed else Mood.GOOD, strong=True)
        for each in self.checks:
            yield Paragraph(f"holds: {each.claim}") if each.holds else Paragraph(f"FAILS: {each.claim}", Mood.BAD)
        cases, mass = list(enumerate(zip(self.cases, CASES, strict=True), 1)), self.second_payload["M"]
        moments = [
            (f"case {k} {name}", case[name], getattr(printed, name), getattr(printed, f"{name}_2sigma"))
            for k, (case, printed) in cases
            for name in ("MZ", "M")
        ]
        yield _beside(
            "Table 2: payload parameters with the gains of each case [kg m, kg]",
            "Parameter|True|Ours|2 sigma|Rel. sigma [%]|Paper|Paper's\n2 sigma|Paper's\nrel. sigma [%]",
            "{}|{:.3f}|{:.3f}|{:.4f}|{:.1f}|{:.3f}|{:.4f}|{:.1f}",
            [
                (name, p.true, p.estimate, 2 * p.std, 100 * p.std / abs(p.estimate), value, two, 50 * two / value)
                for name, p, value, two in moments
            ],
        )
        yield _beside(
            "Table 3: identified drive gains [N m / drive unit]",
            "Joint|Injected|Ours|2 sigma|Paper|Paper's\n2 sigma",
            "joint {}|{:.4f}|{}|{}|{}|{}",
            [
                (
                    gain.joint,
                    gain.true,
                    "refused" if gain.estimate is None else f"{gain.estimate:.4f}",
                    NONE if gain.std is None else f"{2 * gain.std:.4f}",
                    *(f"{of[k]:.4f}" if k < IDENTIFIED else NONE for of in (GAINS, GAINS_2SIGMA)),
                )
                for k, gain in enumerate(self.gains)
            ],
        )
        for gain in self.gains:
            if gain.reason is not None:
                yield Paragraph(sentence(f"Joint {gain.joint}: {gain.reason}"))
        yield _beside(
            "Table 4: error norm, relative norm, sigma, degrees of freedom; ours, then the paper's",
            "Case|Norm|Relative|Sigma|r - b|Paper's\nnorm|Paper's\nrelative|Paper's\nsigma|Paper's\nr - b",
            "case {}|{:.2f}|{:.4f}|{:.4f}|{}|{:.2f}|{:.4f}|{:.4f}|{}",
            [
                (
                    *(k, case.fit.error_norm, case.fit.rel_error_norm, case.fit.sigma),
                    *(case.fit.rows - case.fit.unknowns, p.error_norm, p.rel_error_norm, p.sigma, ROWS_LESS_UNKNOWNS),
                )
                for k, (case, p) in cases
            ],
        )
        yield _beside(
            "The second payload with the gains of case 2 [kg]",
            "Parameter|True|Ours|2 sigma|Paper|Paper's\n2 sigma",
            "{}|{:.3f}|{:.3f}|{:.3f}|{:.3f}|{:.3f}",
            [(mass.parameter, mass.true, mass.estimate, 2 * mass.std, SECOND_MASS, SECOND_MASS_2SIGMA)],
        )


def _beside(title: str, heads: str, form: str, rows: Iterable[Sequence[object]]) -> Table:
    """Return a table of columns and formats that are separated by bars; the first column has words."""
    columns = [column(head, itemgetter(k), words=not k) for k, head in enumerate(heads.split("|"))]
    return table([form.format(*row).split("|") for row in rows], *columns, title=title)


class PaperRun(NamedTuple):
    """The repeated experiment: its seed, payload estimates by name (`case 1`, `second payload`), and what is shown."""

    seed: int
    estimates: Mapping[str, PaperEstimate]
    result: PaperResult


def run_paper(seed: int, *, stages: Progress = SILENT) -> PaperRun:
    """Simulate the three motions, identify gains and payloads, check the claims; raises as `experiments.run.run`."""
    setup = setup_of(load_scenario("paper"))
    chosen, first = setup.scenario.table.identification, setup.payloads[LOADED]
    weighed = read_payload(rx90_mjcf.PAYLOADS["4.275 kg"])
    bare, heavy = setup.experiments
    light = replace(heavy, name="second payload", plant=replace(heavy.plant, payload=body_of(weighed)))
    streams = [noise_streams(np.random.default_rng(child)) for child in np.random.SeedSequence(seed).spawn(3)]
    stages.begin("simulating", sum(each.trajectory.duration for each in (bare, heavy, light)))
    recordings = record([bare, heavy, light], streams, threads=1, advanced=stages.advance)
    stages.begin("identifying")
    unloaded, loaded, second = (observe(recording, setup.structure, chosen.observe) for recording in recordings)
    gains = joint_by_joint_gains(pair(unloaded, loaded, first, chosen.gains)).joints
    prior, none = np.ones(len(gains)), np.zeros(len(gains))
    found, std, off = prior.copy(), none.copy(), prior.copy()  # a refused joint keeps its assumed gain
    off[:IDENTIFIED] += GAIN_ERRORS
    for j, joint in enumerate(gains[:IDENTIFIED]):
        if isinstance(joint, IdentifiedGain):
            found[j], std[j] = joint.value, joint.std
    systems = {
        mounted.name: Columns.of([ObservedMotion(unloaded, None), ObservedMotion(motion, payload)])
        for mounted, motion, payload in ((heavy, loaded, first), (light, second, weighed))
    }
    given = {
        "case 1": (heavy, prior, none),
        "case 2": (heavy, found, none),
        "case 3": (heavy, off * found, none),
        "second payload": (light, found, std),
    }
    estimates = {
        name: payload_as_in_paper(systems[mounted.name], gain, gain_std)
        for name, (mounted, gain, gain_std) in given.items()
    }
    *cases, again = (_payload(estimates[name], mounted) for name, (mounted, *_) in given.items())
    shown = tuple(
        PaperGain(
            joint=joint,
            true=injected,
            estimate=getattr(each, "value", None),
            std=getattr(each, "residual_std", None),
            identifiable=isinstance(each, IdentifiedGain),
            reason=getattr(each, "reason", None),
        )
        for joint, (each, injected) in enumerate(zip(gains, setup.true_gain.tolist(), strict=True), 1)
    )
    checks = checks_of(shown, cases, again)
    passed = all(check.holds for check in checks)
    result = PaperResult(gains=shown, cases=tuple(cases), second_payload=again, checks=checks, passed=passed)
    return PaperRun(seed=seed, estimates=estimates, result=result)


def _payload(case: PaperEstimate, experiment: Experiment) -> PaperPayload:
    body = experiment.plant.payload
    true = standard_parameters(body.mass, body.com, body.inertia).tolist()
    payload = tuple(
        PaperParameter(parameter=p.name, true=value, estimate=p.value, std=p.std, essential=essential)
        for p, essential, value in zip(case.parameters, case.essential, true, strict=True)
    )
    names = ("unknowns", "error_norm", "rel_error_norm", "sigma")
    fit = PaperFit(rows=len(case.system.V), **{name: getattr(case, name) for name in names})
    return PaperPayload(gains=tuple(case.gain.tolist()), payload=payload, fit=fit)


def checks_of(
    gains: Sequence[PaperGain], cases: Sequence[PaperPayload], second_payload: PaperPayload
) -> tuple[Claim, ...]:
    """Return the claims of the paper."""
    one, two, three = cases
    mass, second = two["M"], second_payload["M"]
    pairs = zip(gains, GAINS_2SIGMA, strict=False)
    inside = [gain.estimate is not None and abs(gain.estimate - gain.true) < bound for gain, bound in pairs]
    norm = three.fit.rel_error_norm / two.fit.rel_error_norm
    rows = (two.fit.rows - two.fit.unknowns) / ROWS_LESS_UNKNOWNS
    claims = {
        f"case 2 estimates a mass closer to {mass.true:g} kg than case 1": (
            abs(mass.estimate - mass.true) < abs(one["M"].estimate - mass.true)
        ),
        "case 3 estimates 1.2 times the mass of case 2, within 0.05 (paper: 1.206)": (
            abs(three["M"].estimate / mass.estimate - 1.2) < 0.05
        ),
        "case 3 estimates a smaller MZ than case 2 (paper: 0.928 times)": three["MZ"].estimate / two["MZ"].estimate < 1,
        "case 3 has an error norm larger by 5 % or more than case 2 (paper: 12.8 %)": norm >= 1.05,
        "the identified gains agree with table 3 within the paper's 2 sigma": all(inside),
        "joint 6 is refused": not gains[5].identifiable,
        "the relative error norm of case 2 is the paper's 7.45 %, within 1 %": (
            abs(two.fit.rel_error_norm - CASES[1].rel_error_norm) < 0.01
        ),
        "the degrees of freedom are the paper's 4416, within 5 %": abs(rows - 1.0) < 0.05,
        f"the mass of the second payload is within 2 sigma of {second.true:g} kg": (
            abs(second.estimate - second.true) < 2.0 * second.std
        ),
    }
    return tuple(Claim(claim=claim, holds=holds) for claim, holds in claims.items())


class SavedPaper(BaseModel):
    """`paper.json`: the result of `rx90 paper`, provenance, and digests of the other files."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    format: Literal[1] = 1
    seed: int
    command: str
    versions: dict[str, str]
    files: dict[str, str]
    result: PaperResult


def write_paper(run: PaperRun, folder: Path, *, command: str) -> None:
    """Write `FILES`: torques [N m] of all cases by time [s], as in figure 3; the result."""
    rows = list[pd.DataFrame]()
    for name, case in run.estimates.items():
        joint, measured = case.system.joint, case.gain[case.system.joint] * case.system.V
        about = {"case": name, "joint": joint + 1, "loaded": case.system.loaded, "t": case.system.t}
        rows.append(pd.DataFrame({**about, "measured": measured, "reconstructed": case.torque}))
    pd.concat(rows).to_parquet(folder / ROWS, index=False)
    files = digests_of(folder, [ROWS])
    saved = SavedPaper(seed=run.seed, command=command, versions=versions(), files=files, result=run.result)
    (folder / PAPER).write_text(to_json(with_digest(saved.model_dump(mode="json"))) + "\n", encoding="utf-8")


def page(folder: Path) -> Report:
    """Return the page of a folder, only from its files; raises `ScenarioError` if they are not as written."""
    saved = read_result(folder, SavedPaper, PAPER)
    check_files(folder, {ROWS: saved.files.get(ROWS, "")}, PAPER)
    torques = pd.read_parquet(folder / ROWS).query(f"case == 'case {DRAWN}'")  # the file that was written
    more: list[Part] = [Heading("Figure 3: torques of case 2, measured and reconstructed"), Paragraph(TORQUES)]
    end = float(torques["t"].to_numpy().max())
    for joint in range(IDENTIFIED):
        own = torques.query("joint == @joint + 1").sort_values(["loaded", "t"])
        t, measured, reconstructed = own[["t", "measured", "reconstructed"]].to_numpy(np.float64).T
        motion, starts = own["loaded"].to_numpy(np.intp), [("bare flange", 0.0), ("7.025 kg", end)]
        more.append(torque_plot(joint, "N m", t + end * motion, measured, measured - reconstructed, motion, starts))
    facts = {"Seed": str(saved.seed)}
    more += repeated({"Original command": saved.command}, facts, saved.versions, saved.files)
    return saved.result.report(saved.result.title(saved.seed), *more)
