"""Writes coverage.md and coverage.png from the folders of studies that `rx90 monte-carlo ... --out FOLDER` left."""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from coverage_claims import JointClaims, Target, curves, joint_claims
from scipy import stats

from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.studies.calibration import GRID, Calibration, calibration
from scenarios.experiments.studies.folder import STUDY, StudyFolder
from scenarios.experiments.studies.joint_rows import COLUMNS, rows_in
from scenarios.experiments.studies.monte_carlo import monte_carlo
from scenarios.experiments.studies.pass_rule import FALSE_ALARM
from scenarios.experiments.studies.statistics import Coverage, joint_statistics
from scenarios.experiments.trials import run_trials
from scenarios.rendering.content import (
    NONE,
    Column,
    Figure,
    Heading,
    Line,
    Paragraph,
    Part,
    Report,
    Table,
    cells,
    number,
    percent,
)
from scenarios.reports.files import write_figures, write_markdown
from scenarios.support.versions import versions

TARGET, HONEST = Target(low=0.93, high=0.975), float(2.0 * stats.norm.cdf(2.0) - 1.0)
WIDEST = 1.35
SETS = Path(__file__).parent / "coverage"
"""Scenarios of one error source each, for studies; `rx90 monte-carlo docs/coverage/zeros.toml -n 300 --out FOLDER`."""
CALIBRATED = "fleet"
LEVEL, DRAWS = 0.95, 20_000
REPEATED, SAME = 3, 1e-6
HEAD = (
    "How often the intervals of the default method contain the injected gains. Target for every joint: 2 sigma contain "
    f"it in {100 * TARGET.low:g} to {100 * TARGET.high:g} % of the trials, with a median sigma of at most {WIDEST} "
    "times the standard deviation of the errors. Written by `make coverage` from the folders of `rx90 monte-carlo`; no "
    "number is typed by hand."
)
MEANING = (
    "Refused: trials that gave no gain for the joint; failed: trials without any estimate. Bias (± its own standard "
    "deviation), standard deviation, 95th percentile and largest magnitude are of the relative error. Within: share of "
    "the trials with a gain whose error is below 1 or 2 estimated standard deviations (68.3 % and 95.4 % if these are "
    "correct), in brackets its 95 % interval (Clopper and Pearson). Width: median of the estimated standard deviation "
    "over that of the errors."
)
RANKS = (
    "If the estimated standard deviations are correct, the ranks of z, the error over the estimated standard "
    "deviation, in the standard normal distribution are uniform. The curve is the empirical distribution of the ranks "
    "minus the uniform one. Intervals that are too wide make it fall in the left half and rise in the right half, too "
    f"narrow ones the reverse; a bias shifts the whole curve to one side. In {100 * LEVEL:g} % of studies with correct "
    f"intervals the band contains the whole curve of a joint (Säilynoja, Bürkner and Vehtari 2022, by {DRAWS} "
    "simulated curves). The errors of the joints in one trial are correlated, as they share the payload; the band of "
    "all joints includes this correlation."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Covered:
    """A finished study: its record, its rows, and what they say joint by joint."""

    record: dict
    rows: pd.DataFrame
    joints: tuple[JointClaims, ...]
    failures: Mapping[str, int]
    ended: datetime

    @property
    def name(self) -> str:
        return self.record["scenario"]["name"]

    @property
    def tolerance(self) -> dict:
        return self.record["scenario"]["table"]["tolerance"]

    @property
    def trials(self) -> int:
        return self.record["trials"]


def covered(folder: Path) -> Covered:
    record = json.loads((folder / STUDY).read_text(encoding="utf-8"))
    tolerance = record["scenario"]["table"]["tolerance"]
    place = StudyFolder(folder, len(tolerance["gain"]))
    if record["study"] != "monte-carlo" or place.missing(record["trials"]):
        sys.exit(f"{folder}: no finished study of rx90 monte-carlo; go on with: {record['command']}")
    gathered = rows_in(place)
    statistics = joint_statistics(gathered.joints, wanted=tolerance["pass_rate"], false_alarm=FALSE_ALARM)
    ended = max(path.stat().st_mtime for path in place.trials.iterdir())
    joints = tuple(joint_claims(*each) for each in zip(gathered.joints, statistics, strict=True))
    return Covered(
        record=record,
        rows=place.table(["trial", *COLUMNS]),
        joints=joints,
        failures=gathered.failures,
        ended=datetime.fromtimestamp(ended, UTC),
    )


# What is wanted and what is


def standing(found: Coverage) -> str:
    side = TARGET.side(found)
    return side if side == "inside" or not TARGET.reached_by(found) else f"{side}, not significantly"


def misses(study: Covered) -> list[str]:
    """A sentence for every joint that misses a target."""
    said: list[str] = []
    for joint in study.joints:
        of = joint.statistics.joint
        if joint.cover_2 and standing(joint.cover_2) != "inside":
            said.append(f"Joint {of}: 2 sigma contain {share(joint.cover_2)} %, {standing(joint.cover_2)}.")
        if joint.width and joint.width > WIDEST:
            wide = f"{joint.width:.2f} times the standard deviation of the errors"
            said.append(f"Joint {of}: sigma is {wide}, more than {WIDEST}.")
    return said


def by_chance(trials: int) -> float:
    """Chance that a share of honest intervals lies outside the target."""
    shares = np.arange(trials + 1) / trials
    outside = (shares < TARGET.low) | (shares > TARGET.high)
    return float(stats.binom.pmf(np.arange(trials + 1), trials, HONEST)[outside].sum())


# Tables


def method_of(study: Covered) -> str:
    """The method and where its deviation is from."""
    identification = study.record["scenario"]["table"]["identification"]
    return f"{identification['method']}, {identification['gains']['uncertainty']}"


def share(found: Coverage | None) -> str:
    if found is None:
        return NONE
    return f"{percent(found.share, '.1f')} ({percent(found.low, '.1f')}..{percent(found.high, '.1f')})"


def summary(studies: list[Covered]) -> Table:
    titles = ("Scenario", "Method", "Trials", "Gains", "inside", "outside, not significantly", "outside", "too wide")
    rows = []
    for study in studies:
        found = [joint for joint in study.joints if joint.cover_2]
        sides = [standing(joint.cover_2) for joint in found]
        inside, reaching = sides.count("inside"), sum("," in side for side in sides)
        rows.append(
            cells(
                study.name,
                method_of(study),
                str(study.trials),
                str(sum(joint.gains for joint in found)),
                *map(str, (inside, reaching, len(sides) - inside - reaching)),
                str(sum(bool(joint.width) and joint.width > WIDEST for joint in found)),
            )
        )
    return Table(columns=tuple(Column(title=title, words=title in titles[:2]) for title in titles), rows=tuple(rows))


def joint_table(study: Covered) -> Table:
    columns = (
        Column(title="Joint"),
        *(Column(title=title) for title in ("Gains", "Refused", "Failed")),
        *(Column(title=title, unit="%") for title in ("Bias", "Std", "95 % below", "Largest")),
        *(Column(title=f"Within {k} sigma", unit="%") for k in (1, 2)),
        Column(title="2 sigma", words=True),
        Column(title="Width"),
    )
    rows = []
    for joint in study.joints:
        of = joint.statistics
        bias = NONE if of.bias_std is None else f"{percent(of.bias, '+.3f')} ± {percent(of.bias_std)}"
        rows.append(
            cells(
                str(of.joint),
                *map(str, (joint.gains, of.refused, of.failed)),
                *(bias, percent(of.spread), percent(of.p95), percent(joint.largest)),
                *(share(joint.cover_1), share(joint.cover_2)),
                NONE if joint.cover_2 is None else standing(joint.cover_2),
                number(joint.width, ".2f"),
            )
        )
    return Table(columns=columns, rows=tuple(rows))


def study_parts(study: Covered) -> list[Part]:
    said = misses(study) or ["Every joint with a gain is inside both targets."]
    kinds = study.failures
    said += [f"{count} of {study.trials} trials failed: {kind}." for kind, count in kinds.items()]
    return [
        Heading(f"{study.name}, {study.trials} trials"),
        joint_table(study),
        *(Paragraph(sentence) for sentence in said),
    ]


# Calibration


def calibrations(study: Covered) -> dict[str, Calibration]:
    """Of all joints that should have a gain together, over the trials that have all of them, and of each."""
    wanted = [joint for joint, is_wanted in enumerate(study.tolerance["identifiable"], 1) if is_wanted]
    z = study.rows.pivot(index="trial", columns="joint", values="z")[wanted]
    rng = np.random.default_rng(0)
    together = {"all joints": z.dropna().to_numpy()}
    alone = {f"joint {joint}": z[[joint]].dropna().to_numpy() for joint in z.columns}
    return {name: calibration(values, level=LEVEL, draws=DRAWS, rng=rng) for name, values in (together | alone).items()}


def calibration_table(found: dict[str, Calibration]) -> Table:
    rows = []
    for name, each in found.items():
        worst = int(np.argmax(np.abs(each.difference)))
        left = GRID[each.outside]
        rows.append(
            cells(
                name,
                str(each.trials),
                f"{100 * each.difference[worst]:+.1f}",
                f"{GRID[worst]:.2f}",
                f"{len(left)} of {len(GRID)}: {left[0]:.2f}..{left[-1]:.2f}" if len(left) else "nowhere",
            )
        )
    columns = (
        Column(title="Ranks of", words=True),
        Column(title="Trials"),
        Column(title="Largest difference", unit="%"),
        Column(title="at rank"),
        Column(title="outside the band", words=True),
    )
    return Table(columns=columns, rows=tuple(rows))


def calibration_parts(study: Covered) -> list[Part]:
    found = calibrations(study)
    title = study.name
    return [
        Heading(f"Calibration over {study.name}"),
        Figure("coverage", "Ranks of z with the band of correct intervals", lambda: curves(found, title)),
        calibration_table(found),
        Paragraph(RANKS),
    ]


# How it was made


def provenance(studies: list[Covered], repeated: Paragraph) -> list[Part]:
    """Commands, date, versions and digests, and what the present code makes of some of the trials."""
    made = sorted({json.dumps(study.record["versions"]) for study in studies})
    parts: list[Part] = [Heading("How it was made")]
    parts += [Line(study.record["command"]) for study in studies]
    parts.append(Line("make coverage"))
    for text in made:
        of = ", ".join(study.name for study in studies if json.dumps(study.record["versions"]) == text)
        named = ", ".join(f"{name} {version}" for name, version in json.loads(text).items())
        parts.append(
            Paragraph(f"Versions behind {of}: {named}. `code` is a digest of every file of the four packages.")
        )
    ended = ", ".join(f"{study.name} {study.ended:%Y-%m-%d %H:%M}" for study in studies)
    parts.append(Paragraph(f"Studies ended (UTC): {ended}. Page written {datetime.now(UTC):%Y-%m-%d}."))
    parts += [Paragraph(sentence) for sentence in overlaps(studies)]
    return [*parts, repeated]


def overlaps(studies: list[Covered]) -> list[str]:
    """Sentences that name the studies with trials of the same seeds, which have the same noise."""
    alike = dict[range, list[str]]()
    for study in studies:
        first = study.record["seed"]
        alike.setdefault(range(first, first + study.trials), []).append(study.name)
    if len(studies) > 1 and len(alike) == 1:
        return [f"All studies have the same {len(next(iter(alike)))} seeds, hence the same noise in its own size."]
    found = [
        f"{', '.join(names)}: the same {len(seeds)} seeds, hence the same noise in its own size."
        for seeds, names in alike.items()
        if len(names) > 1
    ]
    for (one, first), (other, second) in combinations(alike.items(), 2):
        if both := len(set(one) & set(other)):
            found.append(f"{', '.join(first)} and {', '.join(second)} share seeds of {both} trials, hence their noise.")
    return found


def repetition(studies: list[Covered]) -> Paragraph:
    """Whether the present code gives the same gains and deviations on the first trials of every study."""
    largest = max(departure(study) for study in studies)
    code = versions()["code"]
    trials = f"The first {REPEATED} trials of every study, repeated with the current code, {code},"
    if largest <= SAME:
        return Paragraph(f"{trials} give the same gains and deviations to {SAME:g} of these deviations.")
    return Paragraph(f"{trials} differ by up to {largest:.2g} deviations: repeat the studies.", strong=True)


def departure(study: Covered) -> float:
    """Largest difference of gain or deviation between a study and its repetition, in deviations; inf if one refuses."""
    own = SETS / f"{study.name}.toml"
    again = monte_carlo(load_scenario(str(own) if own.exists() else study.name), study.trials, study.record["seed"])
    found = run_trials(again.scenario, [again.trial(k) for k in range(REPEATED)], again.schema, threads=1).to_pandas()
    kept = study.rows[study.rows["trial"] < REPEATED]
    if (found["identifiable"].to_numpy() != kept["identifiable"].to_numpy()).any():
        return float("inf")
    old, new = kept[kept["identifiable"]], found[found["identifiable"]]
    gain = (new["rel_error"].to_numpy() - old["rel_error"].to_numpy()) * old["true"].to_numpy()
    deviation = new["std"].to_numpy() - old["std"].to_numpy()
    return float(np.max(np.abs([gain, deviation]) / old["std"].to_numpy(), initial=0.0))


def page(studies: list[Covered], repeated: Paragraph) -> Report:
    trials = min(study.trials for study in studies)
    chance = (
        f"By chance, the share of correct 2 sigma, {100 * HONEST:.1f} %, is outside the target for "
        f"{100 * by_chance(trials):.1f} % of the joints in studies of {trials} trials. Not significantly: the 95 % "
        f"interval of the share overlaps the target. The relative standard deviation of a width is "
        f"{100 / np.sqrt(2 * trials):.1f} %."
    )
    parts: list[Part] = [Paragraph(HEAD), summary(studies), Paragraph(chance)]
    for study in studies:
        parts += study_parts(study)
    parts.append(Paragraph(MEANING))
    for study in studies:
        if study.name == CALIBRATED:
            parts += calibration_parts(study)
    return Report("Coverage", (*parts, *provenance(studies, repeated)), {})


def main(folders: list[Path]) -> None:
    if not folders:
        sys.exit("name the folders of studies")
    studies, here = [covered(folder) for folder in folders], Path(__file__).parent
    report = page(studies, repetition(studies))
    write_figures(report, here)
    write_markdown(report, here / "coverage.md")


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
