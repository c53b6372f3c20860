"""Pages without a browser: what they are made of, what is escaped, which folders are refused."""

import json
import math
import shlex
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import page_folders
import pytest
from scipy import stats

from ident.checks.motion import JointMotion
from ident.estimate import IdentifiedGain, RefusedGain
from scenarios.again import differences, identified_again
from scenarios.cli import main
from scenarios.errors import DamagedResult, ForeignResult, UnfinishedResult
from scenarios.reports.content import (
    Cell,
    Column,
    Figure,
    Heading,
    Line,
    Mood,
    Paragraph,
    Picture,
    Report,
    Table,
    cells,
)
from scenarios.reports.motion import coverage_plot as motion_plot
from scenarios.reports.pages import kind_of, page_of
from scenarios.reports.pages.gain_plots import error_plot, share_plot, what_would_show
from scenarios.reports.pages.joint_rows import JointRows, begins, joint_rows
from scenarios.reports.pages.monte_carlo import NORMAL, coverage_plot
from scenarios.reports.pages.monte_carlo import error_plot as study_error_plot
from scenarios.reports.pages.paper import same
from scenarios.reports.pages.residual_plots import FAR, against, outliers, spectrum_plot
from scenarios.reports.pages.sensitivity import cost_plot, ranking
from scenarios.reports.pages.sensitivity import share_plot as source_shares
from scenarios.reports.pages.still import with_picture
from scenarios.reports.pages.torque_plots import MOST, torque_plot
from scenarios.reports.plot import Axis, Mark, Plot, Reference, Series, Tone, one_in, values
from scenarios.reports.renderers import Page, renderer
from scenarios.reports.renderers.html.scripts import script_code, script_json
from scenarios.reports.renderers.html.specs import STYLES, specification
from scenarios.studies.budget import Interval, JointBudget, SourceCost
from scenarios.studies.joint_rows import JointRows as StudyJointRows

EVIL = "</script><script>alert(1)</script><!--\"'&<img src=x onerror=alert(2)>{{ 7 * 7 }}"
DRAWN = Plot(
    title=EVIL,
    caption=EVIL,
    x=Axis(title=EVIL, unit=EVIL, categories=(EVIL, "two")),
    y=Axis(title=EVIL),
    series=(
        Series(label=EVIL, mark=Mark.INTERVALS, x=(EVIL, "two"), y=(1.5, 2.5), low=(1.0, 2.0), high=(2.0, 3.5)),
        Series(label="bars", mark=Mark.BARS, tone=Tone.SECOND, x=(EVIL,), y=(0.5,)),
    ),
    references=(Reference(EVIL, 2.25),),
)


class Elements(HTMLParser):
    """Elements of a page by name, and all its text outside scripts and styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.inside = ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self.inside = tag

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside not in ("script", "style"):
            self.text += data

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.found)


def drawing():
    from matplotlib.figure import Figure as Drawing

    return Drawing(figsize=(0.5, 0.5))


def evil_report() -> Report:
    table = Table(title=EVIL, columns=(Column(title=EVIL, unit=EVIL, words=True),), rows=(cells(EVIL),))
    parts = (
        Paragraph(EVIL, Mood.BAD, strong=True),
        Heading(EVIL),
        Line(EVIL),
        table,
        Picture(EVIL, b"\x89PNG", 4, 3),
        Figure(EVIL, EVIL, drawing),
        DRAWN,
    )
    return Report(EVIL, parts, {EVIL: EVIL})


def test_no_text_of_a_report_is_html():
    page = renderer("html")(evil_report(), Page())
    elements = Elements(page)
    assert elements.count("script") == 3  # the document, the plots, what draws them
    assert elements.count("img") == 2
    assert all(
        attributes["src"].startswith("data:image/png;base64,") for tag, attributes in elements.found if tag == "img"
    )
    assert not any(name.startswith("on") for _, attributes in elements.found for name in attributes)
    for where in ("h1", "h2", "code", "figcaption", "td", "th"):
        assert elements.count(where) > 0 or where == "td"
    # Title twice, paragraph, heading, line, table (title, column, unit, cell), captions, plot (title, caption, label).
    assert elements.text.count(EVIL) >= 13
    assert "49" not in elements.text


def test_a_page_asks_for_nothing_from_anywhere():
    elements = Elements(renderer("html")(evil_report(), Page()))
    assert elements.count("link") == elements.count("iframe") == 0
    policy = next(a["content"] for tag, a in elements.found if a.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy


def test_json_and_code_cannot_end_their_script_and_mean_the_same():
    text = script_json({EVIL: [EVIL, 0.125, None]})
    assert not set("<>&") & set(text)
    assert json.loads(text) == {EVIL: [EVIL, 0.125, None]}
    assert script_code('a("</script><!--")') == 'a("<\\/script><\\!--")'
    with pytest.raises(ValueError, match="not JSON compliant"):
        script_json(float("nan"))


def test_a_report_without_plots_has_no_library():
    page = renderer("html")(Report("Title", (Paragraph("text"),), {}), Page())
    assert len(page) < 15_000
    assert Elements(page).count("script") == 1


def test_rows_beyond_those_of_a_screen_are_folded_away():
    table = Table(columns=(Column(title="n"),), rows=tuple(cells(str(k)) for k in range(7)), shown=3, rest="and 4 more")
    page = renderer("html")(Report("Title", (table,), {}), Page())
    head, folded = page.split('<details class="rest"><summary>and 4 more</summary>')
    assert [f">{k}<" in head for k in range(7)] == [True] * 3 + [False] * 4
    assert [f">{k}<" in folded for k in range(7)] == [False] * 3 + [True] * 4
    assert (
        Elements(renderer("html")(Report("T", (Table(columns=table.columns, rows=table.rows),), {}), Page())).count(
            "details"
        )
        == 0
    )


@pytest.mark.parametrize("form", ["text", "markdown"])
def test_text_leaves_plots_and_pictures_out(form):
    report = Report("Title", (Paragraph("before"), DRAWN, Picture("seen", b"", 4, 3), Paragraph("after")), {})
    assert renderer(form)(report, Page()) == renderer(form)(
        Report("Title", (Paragraph("before"), Paragraph("after")), {}), Page()
    )


def test_numbers_of_a_plot_have_five_digits_and_gaps_where_there_are_none():
    assert values([1.23456789, -0.000123456, math.nan, math.inf, 1234567.0]) == (
        1.2346,
        -0.00012346,
        None,
        None,
        1234600.0,
    )
    assert [one_in(count, 100) for count in (1, 100, 101, 200, 201)] == [1, 1, 2, 2, 3]


def test_series_that_share_a_joint_stand_beside_each_other_and_stripes_behind_them():
    spec = specification(DRAWN)
    offsets = [layer.get("encoding", {}).get("xOffset") for layer in spec["layer"]]
    assert [each and each["datum"] for each in offsets] == [None, EVIL, "bars"]
    stripe = Series(label="limit", mark=Mark.INTERVALS, tone=Tone.QUIET, x=("two",), y=(0.0,), low=(-1.0,), high=(1.0,))
    alone = Plot(title="", caption="", x=DRAWN.x, y=DRAWN.y, series=(stripe, DRAWN.series[1]))
    behind, _ = specification(alone)["layer"]
    assert "xOffset" not in behind["encoding"]
    assert [each["mark"]["type"] for each in behind["layer"]] == ["rule"]
    quiet = replace(stripe, mark=Mark.BARS, low=(), high=())
    beside = specification(replace(alone, series=(quiet, DRAWN.series[1])))["layer"]
    assert [each["encoding"]["xOffset"]["datum"] for each in beside] == ["limit", "bars"]


def test_every_tone_differs_from_others_without_its_colour():
    assert len({(style.dash, style.shape, style.width) for style in STYLES.values()}) == len(STYLES) == len(Tone)
    fills = sorted(style.fill for style in STYLES.values())
    assert min(np.diff(fills)) >= 0.15


def identified(value: float, std: float, payload: float = 0.0, model: float = 0.0) -> IdentifiedGain:
    return IdentifiedGain(
        joint="j",
        value=value,
        std=std,
        payload_rel_std=payload,
        model_rel_std=model,
        predicted_rel_std=std / abs(value),
    )


def test_shares_of_an_interval_are_two_deviations_in_percent_of_the_gain():
    refused = RefusedGain(joint="k", reason="none", predicted_rel_std=0.35)
    plot = share_plot((identified(-0.8, 0.02, 0.03, 0.007), refused))
    assert plot.x.categories == ("1", "2")
    found = {series.label: (series.x, series.y) for series in plot.series}
    assert found == {"residual": (("1",), (5.0,)), "payload": (("1",), (6.0,)), "model": (("1",), (1.4,))}


def test_what_would_show_a_joint_follows_from_what_its_gain_was_refused_for():
    joints = (
        identified(0.9, 0.01),
        RefusedGain(joint="b", reason="", predicted_rel_std=0.35),
        RefusedGain(joint="c", reason="", predicted_rel_std=None),
        RefusedGain(joint="d", reason="", predicted_rel_std=0.04),
    )
    said = [part.text for part in what_would_show(joints, 0.1)]
    assert [text[:7] for text in said] == ["Joint 2", "Joint 3", "Joint 4"]
    # A deviation falls with the torque, and with the root of the rows: 3.5 times, 12.25 times.
    assert "3.5 times the torque" in said[0]
    assert "12 times as many rows" in said[0]
    assert "say nothing" in said[1]
    assert "not what it is refused for" in said[2]


def rows_of(residual: np.ndarray, **more) -> JointRows:
    n = len(residual)
    given = {
        "joint": 2,
        "scale": 2.5,
        "unit": "N m",
        "t": 0.05 * np.arange(n),
        "V": np.full(n, 4.0),
        "residual": residual,
        "q": np.linspace(-1.0, 2.0, n),
        "dq": np.linspace(3.0, -2.0, n),
        "motion": np.zeros(n, dtype=np.intp),
        "sigma": 0.5,
        "still": ((0.2, 0.3),),
    }
    return JointRows(**{**given, **more})


def test_a_torque_is_the_gain_times_what_is_measured_and_what_the_model_makes_of_it():
    residual = np.array([0.5, -0.25, 0.125, 0.0, 0.75, -0.5])
    plot = torque_plot(rows_of(residual, V=np.arange(1.0, 7.0)), ("bare", "heavy"), (0.0, 0.2, 0.3))
    measured, predicted, left = plot.series
    assert measured.y == (2.5, 5.0, 7.5, 10.0, 12.5, 15.0)
    assert left.y == (1.25, -0.625, 0.3125, 0.0, 1.875, -1.25)
    np.testing.assert_allclose(predicted.y, np.subtract(measured.y, left.y), rtol=1e-4)  # five digits
    assert [(each.label, each.at) for each in plot.references] == [("bare", 0.0), ("heavy", 0.2)]
    assert plot.bands == ((0.2, 0.3),)
    share = np.linalg.norm(residual) / np.linalg.norm(np.arange(1.0, 7.0))
    assert f"{100 * share:.2g} % of its rms is left. Drawn is every row of 6" in plot.caption


def test_a_line_breaks_where_rows_are_left_out_and_between_motions():
    t = np.array([0.0, 0.05, 0.1, 0.4, 0.45, 0.5])
    rows = rows_of(np.ones(6), t=t, motion=np.array([0, 0, 0, 0, 1, 1]))
    at, broken = rows.broken(np.arange(6.0))
    np.testing.assert_array_equal(np.isnan(broken), [0, 0, 0, 1, 0, 1, 0, 0])
    np.testing.assert_allclose(at[[3, 5]], [0.25, 0.425], rtol=1e-12)  # half-way, but for rounding


def test_a_long_line_is_thinned_out_and_its_caption_says_so():
    plot = torque_plot(rows_of(np.ones(2 * MOST + 1)), ("bare",), (0.0, 1.0))
    assert len(plot.series[0].y) == math.ceil((2 * MOST + 1) / 3)
    assert f"one row in 3 of {2 * MOST + 1}" in plot.caption


def test_residuals_against_speed_are_in_percent_of_the_rms_current_with_means_of_tenths():
    rng = np.random.default_rng(3)
    speed = rng.uniform(-2.0, 3.0, 1000)
    rows = rows_of(0.2 * speed**2 + 1e-9 * rng.normal(size=1000), dq=speed, V=np.tile([3.0, -5.0], 500))
    points, means = against(rows, "speed").series
    assert len(points.x) == 143  # one row in 7
    np.testing.assert_allclose(points.y, 100 * 0.2 * np.square(points.x) / np.sqrt(17.0), rtol=1e-3)  # five digits
    assert len(means.x) == 10
    inside = [low < y < high for low, y, high in zip(means.low, means.y, means.high, strict=True)]
    assert all(inside)
    edges = np.quantile(speed, [0.0, 0.1])
    first = (speed >= edges[0]) & (speed < edges[1])
    np.testing.assert_allclose(means.x[0], speed[first].mean(), rtol=1e-3)  # five digits, and one row more or less
    y = 100 * rows.residual[first] / np.sqrt(17.0)
    np.testing.assert_allclose(means.high[0] - means.y[0], 2 * y.std(ddof=1) / np.sqrt(first.sum()), rtol=0.02)


def test_outliers_are_listed_the_farthest_first_with_what_accident_would_give():
    residual = np.zeros(100)
    residual[[7, 60]] = -2.25, 3.5  # 4.5 and 7 deviations
    residual[8] = FAR * 0.5
    motion = np.repeat([0, 1], 50)
    said, table = outliers([rows_of(residual, motion=motion)], ("bare", "heavy"), (0.0, 2.5, 5.0))
    assert said.text.startswith("2 of 100 rows are off by more than 4 ")
    assert f"{100 * 2 * stats.norm.sf(4):.1f} would be" in said.text
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["3", "heavy", "0.50", "+7.0", "+8.75 N m"],
        ["3", "bare", "0.35", "-4.5", "-5.62 N m"],
    ]


def test_results_differ_where_a_number_or_a_refusal_does():
    refused = RefusedGain(joint="b", reason="said so", predicted_rel_std=0.5)
    saved = (identified(0.9, 0.01), refused, identified(1.5, 0.02))
    assert differences(saved, saved) == ()
    close = (
        identified(0.9 * (1 + 3e-10), 0.01),
        RefusedGain(joint="b", reason="other", predicted_rel_std=None),
        saved[2],
    )
    assert differences(saved, close) == ()
    (first,) = differences(saved, (identified(0.9 * (1 + 3e-9), 0.01), *saved[1:]))
    assert first == "joint 1: 0.9 with a deviation of 0.01 was saved, now it is 0.9 with a deviation of 0.01"
    (second,) = differences(saved, (saved[0], identified(1.1, 0.03), saved[2]))
    assert second == "joint 2: a refusal was saved, now it is 1.1 with a deviation of 0.03"
    (third,) = differences(saved, (*saved[:2], identified(1.5, 0.03)))
    assert third.startswith("joint 3: ")
    assert differences(saved, saved[:2]) == ("3 joints were saved, now there are 2",)


@pytest.mark.parametrize(
    ("here", "equal"),
    [
        ({"a": [0.125, None, "x"]}, True),
        ({"a": [0.125 * (1 + 1e-7), None, "x"]}, True),
        ({"a": [0.125 * (1 + 1e-5), None, "x"]}, False),
        ({"a": [0.125, 0.0, "x"]}, False),
        ({"a": [0.125, None]}, False),
        ({"b": [0.125, None, "x"]}, False),
        ({"a": [0.125, None, "y"]}, False),
    ],
)
def test_documents_are_the_same_but_for_rounding(here, equal):
    assert same({"a": (0.125, None, "x")}, here) is equal


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return page_folders.run(tmp_path_factory.mktemp("run"))


@pytest.fixture
def copied(saved, tmp_path):
    return shutil.copytree(saved, tmp_path / "copied")


def test_a_run_identified_again_from_its_folder_is_the_same(saved):
    again = identified_again(saved)
    assert again.differences == ()
    assert [gain.estimate is None for gain in again.result.gains] == [False, False, False, True, False, True]
    evidence = again.evidence
    start = begins(evidence)
    assert start[0] == 0.0
    rows = joint_rows(evidence, 1, start)
    own = evidence.estimate.solution.rows.of(1)
    np.testing.assert_array_equal(rows.V, evidence.estimate.solution.rows.V[own])
    seen = [motion.observation for motion in evidence.problem.motions]
    for k, observed in enumerate(seen):
        # Rows of a motion are as far from each other on the page as in the log, and lie inside it.
        t = rows.t[rows.motion == k]
        behind, log = observed.full_rate, again.motions[k].recording
        first = log.t[0] + (behind.edge + 0.5 * (behind.group - 1)) * log.period  # time of the first filtered sample
        np.testing.assert_allclose(t - start[k], observed.joints[1].t - first, rtol=0, atol=1e-9)  # rounding
        assert start[k] < t[0] < t[-1] < start[k + 1]
        still = [(a, b) for a, b in rows.still if start[k] <= a < start[k + 1]]
        shaded = sum(b - a for a, b in still) / behind.period
        assert round(shaded) == int((~behind.moving[:, 1]).sum())
        # Where the shading ends, the joint has just passed the speed below which samples are left out.
        edge = round((still[0][1] - start[k]) / behind.period)
        assert behind.moving[edge, 1]
        assert not behind.moving[edge - 1, 1]
    gain = again.found.estimate.joints[1]
    assert (rows.scale, rows.unit) == (gain.value, "N m")
    assert joint_rows(evidence, 3, start).unit == "drive units"


def test_the_page_says_at_the_top_what_is_not_as_it_was_saved(copied):
    result = json.loads((copied / "result.json").read_text())
    result["gains"][2]["estimate"] *= 1.001
    (copied / "result.json").write_text(json.dumps(result))
    record = json.loads((copied / "record.json").read_text())
    from scenarios.store.record import digests_of

    record["files"] |= digests_of(copied, ["result.json"])
    (copied / "record.json").write_text(json.dumps(record))
    first, second = page_of(copied).parts[:2]
    assert first.strong
    assert second.mood is Mood.BAD
    assert "the gains are not those of result.json: joint 3: " in second.text


def test_verdict_gains_and_refusals_come_first(saved):
    report = page_of(saved)
    result = json.loads((saved / "result.json").read_text())
    headings = [part.text for part in report.parts if isinstance(part, Heading)]
    assert headings == [
        "Gains",
        "Refused or missed, and what would show it",
        "Consistency",
        "Torques, measured and reconstructed",
        "What is left: spectrum",
        "What is left, against position",
        "What is left, against speed",
        "Outliers",
        "Motion, and what it covers",
        "What was assumed",
        "To repeat it",
    ]
    assert report.document == result
    commands = [part.text for part in report.parts if isinstance(part, Line)]
    assert "run" in commands[0].split()
    plots = [part for part in report.parts if isinstance(part, Plot)]
    assert sum(plot.zoom for plot in plots) == 6
    errors = error_plot([gain.verdict for gain in identified_again(saved).result.gains])
    shown = dict(zip(errors.series[1].x, errors.series[1].y, strict=True))
    tops = dict(zip(errors.series[1].x, errors.series[1].high, strict=True))
    # The second motion is drawn behind the first.
    assert all(plot.references[1].at > 0.9 * max(plot.series[0].x) / 2 for plot in plots if plot.zoom)
    allowed = [100 * gain["tolerance"] for gain in result["gains"]]
    assert errors.series[0].high == tuple(allowed)
    assert errors.series[0].low == tuple(-each for each in allowed)
    for gain in result["gains"]:
        if gain["identifiable"]:
            half = 200 * gain["std"] / gain["true"]
            assert tops[str(gain["joint"])] == pytest.approx(100 * gain["rel_error"] + half, rel=6e-5)  # five digits
            assert shown[str(gain["joint"])] == pytest.approx(100 * gain["rel_error"], rel=6e-5)  # five digits


def test_the_commands_on_the_page_give_the_same_gains(saved, capsys):
    command = [part.text for part in page_of(saved).parts if isinstance(part, Line)][1]
    capsys.readouterr()
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    stored = json.loads((saved / "result.json").read_text())
    assert [gain["estimate"] for gain in found["gains"]] == [
        # The same files and method; the arm is read from its minimal model.
        None if gain["estimate"] is None else pytest.approx(gain["estimate"], rel=1e-9)
        for gain in stored["gains"]
    ]


def test_identified_logs_are_saved_with_all_that_it_takes(saved, tmp_path, capsys):
    folder = page_folders.identification(tmp_path / "again", saved)
    report = page_of(folder)
    assert report.title == "Drive gains of rx90 by ls-2011"
    again = identified_again(folder)
    assert again.differences == ()
    assert again.given.observing.cutoff_hz == 14.0
    assert [motion.recording.name for motion in again.motions] == [
        str(saved / "unloaded.parquet"),
        str(saved / "loaded.parquet"),
    ]
    assert report.parts[0].text.startswith("4 of 6 gains identified from ")
    assert "--cutoff-hz 14.0" in [part.text for part in report.parts if isinstance(part, Line)][1]


def test_bare_recordings_alone_are_not_saved(saved, tmp_path, capsys):
    words = ["--model", str(saved / "robot.xml"), "--unloaded", str(saved / "unloaded.parquet")]
    assert main(["identify", *words, "--save", str(tmp_path / "new")]) == 2
    assert "--save: bare recordings give ratios" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_check_made_again_says_the_same_and_a_changed_result_is_noticed(saved, tmp_path, capsys):
    folder = page_folders.check(tmp_path / "checked", saved, "--loaded", str(saved / "loaded.parquet"))
    report = page_of(folder)
    told = json.loads((folder / "result.json").read_text())
    assert report.parts[0].text.startswith(f"{told['verdict'].upper()}: ")
    assert not any(isinstance(part, Paragraph) and "Checked again" in part.text for part in report.parts)
    table = next(part for part in report.parts if isinstance(part, Table))
    assert [row[3].text for row in table.rows] == [line["seen"] for line in told["lines"]]
    currents = [part for part in report.parts if isinstance(part, Plot) and part.zoom]
    assert len(currents) == 12
    recording = identified_again(saved).motions[0].recording
    # The lowest and the highest sample of all are drawn, however few of the others are.
    assert max(currents[2].series[0].y) == pytest.approx(recording.v[:, 2].max(), rel=6e-5)
    assert min(currents[2].series[0].y) == pytest.approx(recording.v[:, 2].min(), rel=6e-5)
    assert len(currents[2].series[0].y) < 0.2 * len(recording.t)
    words = shlex.split([part.text for part in report.parts if isinstance(part, Line)][1])
    assert words[:3] == ["rx90", "check", str(folder / "robot.xml")]
    assert words[words.index("--loaded") + 1 :][:3] == [
        str(folder / "motion-2.parquet"), "--payload", str(folder / "payload.toml")
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("spoil", "error", "said"),
    [
        (lambda folder: (folder / "record.json").unlink(), ForeignResult, "no record.json: half written, or older"),
        (lambda folder: (folder / "record.json").write_text("{"), ForeignResult, "damaged, or of another version"),
        (lambda folder: (folder / "record.json").write_text('{"kind": "dream"}'), ForeignResult, "states kind 'dream'"),
        (lambda folder: (folder / "record.json").write_text('{"kind": "run"}'), ForeignResult, "save it again"),
        (lambda folder: (folder / "loaded.parquet").unlink(), DamagedResult, "loaded.parquet: No such file"),
        (
            lambda folder: (folder / "payload.toml").write_text(""),
            DamagedResult,
            "is not the file that record.json names",
        ),
        (shutil.rmtree, ForeignResult, "is no folder"),
        (
            lambda folder: [path.unlink() for path in folder.iterdir() if path.is_file()],
            ForeignResult,
            "holds no result; expected a folder that run, identify",
        ),
    ],
)
def test_what_is_no_whole_result_of_this_version_is_refused_in_one_line(spoil, error, said, copied, capsys):
    spoil(copied)
    with pytest.raises(error) as raised:
        page_of(copied)
    assert said in str(raised.value)
    capsys.readouterr()
    assert main(["report", str(copied), "--out", str(copied.parent / "out.html")]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not (copied.parent / "out.html").exists()


def test_studies_that_are_not_finished_or_not_whole_are_refused(tmp_path):
    folder = page_folders.study(tmp_path)
    assert kind_of(folder) == "monte-carlo"
    report = page_of(folder)
    commands = [part.text for part in report.parts if isinstance(part, Line)]
    assert commands[0].startswith("rx90 run ")
    rows = next(part for part in report.parts if isinstance(part, Table) and part.columns[0].title == "Seed").rows
    z = [abs(float(row[3].text)) for row in rows]
    assert z == sorted(z, reverse=True)
    assert f"--seed {rows[0][0].text} --save" in commands[0]
    held = next(part for part in report.parts if isinstance(part, Plot) and part.references)
    assert held.references[0].at == pytest.approx(100 * math.erf(math.sqrt(2.0)), rel=1e-12) == 100 * NORMAL
    record = json.loads((folder / "study.json").read_text())
    (folder / "study.json").write_text(json.dumps({**record, "trials": 9}))
    with pytest.raises(UnfinishedResult, match=r"3 of 9 trials are missing; go on with: rx90 monte-carlo"):
        page_of(folder)
    (folder / "study.json").write_text(json.dumps({**record, "study": "comparison"}))
    with pytest.raises(ForeignResult, match="one scenario of a comparison; name the folder it is in"):
        page_of(folder)
    del record["scenario"]["table"]["tolerance"]["gain"]
    record["scenario"]["table"]["tolerance"]["gian"] = [0.5]
    (folder / "study.json").write_text(json.dumps(record))
    with pytest.raises(ForeignResult, match="is damaged, or of another version of rx90"):
        page_of(folder)


def test_a_comparison_is_read_back_as_it_was_written(tmp_path):
    folder = page_folders.comparison(tmp_path / "compared")
    report = page_of(folder)
    assert report.parts[0].text == f"On {page_folders.NAME} {page_folders.NAME} scores 61.0 %, theirs 61.0 %."
    rms, held = (part for part in report.parts if isinstance(part, Plot))
    assert [series.label for series in rms.series] == [page_folders.NAME, "theirs"]
    assert rms.series[1].y == (3.4, 6.8, 10.2)
    assert held.series[0].low == (55.0, 55.0, 55.0)
    (folder / "report.json").write_text('{"about": {}, "scenarios": [{"name": "here"}]}')
    with pytest.raises(ForeignResult, match="is damaged, or of another version of rx90"):
        page_of(folder)


def test_a_page_of_ours_is_replaced_and_no_other_file(tmp_path, capsys):
    folder = page_folders.comparison(tmp_path / "compared")
    assert main(["report", str(folder)]) == 0
    assert "report.html: " in capsys.readouterr().out
    assert main(["report", str(folder)]) == 0
    (folder / "report.html").write_text("mine")
    assert main(["report", str(folder)]) == 2
    assert "changed since rx90 report wrote it" in capsys.readouterr().err
    assert (folder / "report.html").read_text() == "mine"
    assert main(["report", str(folder), "--force"]) == 0
    assert Elements((folder / "report.html").read_text()).count("table") == 3


def test_where_nothing_can_be_drawn_the_page_has_no_picture(copied, monkeypatch, tmp_path):
    report = Report("Title", (Paragraph("verdict"), Paragraph("rest")), {})
    assert with_picture(report, tmp_path) is report
    monkeypatch.setenv("MUJOCO_GL", "no-such-thing")
    assert with_picture(report, copied) is report


def test_a_cell_keeps_its_mood():
    table = Table(columns=(Column(title="a"), Column(title="b", words=True)), rows=((Cell("1"), Cell("x", Mood.BAD)),))
    assert '<td class="bad words">x</td>' in renderer("html")(Report("T", (table,), {}), Page())


def test_the_spectrum_of_unrelated_rows_lies_about_one_between_its_lines():
    rng = np.random.default_rng(5)
    n, period = 600, 0.05
    t, motion = np.r_[period * np.arange(n), 40.0 + period * np.arange(n)], np.repeat([0, 1], n)
    white = rows_of(rng.normal(scale=0.7, size=2 * n), t=t, motion=motion)
    of_all = SimpleNamespace(
        joint=np.full(2 * n, 2),
        motion=motion,
        position=np.tile(np.arange(n), 2),
        residual=white.residual,
        row_period=period,
    )
    plot = spectrum_plot(white, of_all)
    (line,) = plot.series
    assert 0.0 < line.x[0] < 1.0
    assert 9.0 < line.x[-1] < 10.0  # half the rate of the rows
    low, high = (each.at for each in plot.references)
    # 29 seconds twice: 289 frequencies, 12 to a point, two numbers of either motion to each.
    assert (low, high) == pytest.approx(tuple(stats.chi2.ppf([0.025, 0.975], 48) / 48), rel=1e-12)
    inside = sum(low < y < high for y in line.y)
    assert inside >= 20  # of 24: fewer in one of 200 choices of a seed
    np.testing.assert_allclose(np.mean(line.y), 1.0, rtol=0.1)  # 576 squares of either sort: 4 % is one deviation
    wave = rows_of(np.sin(2.0 * np.pi * 3.1 * t), t=t, motion=motion)
    tall = spectrum_plot(wave, of_all).series[0]
    assert abs(tall.x[int(np.argmax(tall.y))] - 3.1) < 0.5


def trial_rows(z: np.ndarray, *, joint: int = 4, tolerance: float = 0.02) -> StudyJointRows:
    return StudyJointRows(
        joint=joint,
        trials=len(z),
        failed=0,
        passed=len(z),
        tolerance=tolerance,
        rel_error=-0.012 * z,
        claimed=np.full(len(z), 0.012),
        z=z,
        step=1,
        true=np.full(len(z), -2.5),
    )


def test_errors_of_a_study_are_a_density_beside_the_one_that_is_claimed():
    z = np.random.default_rng(9).normal(size=400)
    plot = study_error_plot(4, trial_rows(z))
    errors, claimed = plot.series
    x, y = np.array(errors.x), np.array(errors.y)
    np.testing.assert_allclose(np.sum(np.diff(x) * 0.5 * (y[1:] + y[:-1])), 1.0, rtol=1e-3)  # five digits
    np.testing.assert_allclose(max(claimed.y), stats.norm.pdf(0.0, scale=1.2), rtol=1e-4)  # five digits
    assert [each.at for each in plot.references] == [-2.0, 2.0]
    assert plot.caption == "400 errors."
    far = study_error_plot(4, trial_rows(z, tolerance=0.5))
    assert far.references == ()
    assert far.caption == "400 errors. The tolerance, 50 %, is beyond."


def test_coverage_is_that_of_two_deviations():
    z = np.random.default_rng(9).normal(size=390)
    plot = coverage_plot((trial_rows(np.r_[z, np.nan]), trial_rows(np.empty(0), joint=6)))
    (series,) = plot.series
    assert plot.x.categories == ("4", "6")
    assert series.x == ("4",)
    held = int((np.abs(z) < 2.0).sum())
    assert series.y[0] == pytest.approx(100 * held / 390, rel=6e-5)  # five digits
    interval = stats.binomtest(held, 390).proportion_ci(0.95)
    assert (series.low[0], series.high[0]) == pytest.approx((100 * interval.low, 100 * interval.high), rel=6e-5)


def cost(source: str, share: float, rms: float) -> SourceCost:
    size = Interval(value=rms, low=0.9 * rms, high=1.2 * rms)
    return SourceCost(joint=3, source=source, trials=4, bias=0.0, rms=size, share=share, first=None, total=None)


def test_sources_are_ranked_by_their_shares_over_all_joints_and_the_rest_is_told():
    shares = {"a": 0.1, "b": 0.5, "c": 0.05, "d": 0.2, "e": 0.12, "f": 0.03}
    costs = tuple(cost(source, share, 0.01 * share) for source, share in shares.items())
    budget = JointBudget(joint=3, costs=costs, floor=0.0, together=0.02, samples=4, lost=0)
    order = ranking([budget, budget])
    assert order == ["b", "d", "e", "a", "c", "f"]
    found = {series.label: series.y for series in source_shares([budget], order).series}
    assert found == {"b": (50.0,), "d": (20.0,), "e": (12.0,), "a": (10.0,), "all others": (8.0,)}
    plot = cost_plot(budget, order[:3], 0.7)
    (bars,) = plot.series
    assert (bars.y, bars.x) == (("b", "d", "e"), (0.5, 0.2, 0.12))
    assert bars.high == (0.6, 0.24, 0.144)
    assert [each.at for each in plot.references] == [0.7]
    assert cost_plot(budget, order, 1.1).references == ()


def test_a_joint_is_shown_in_shares_of_its_range(arm):
    motion = JointMotion(
        low=float(arm.lower[1] + 0.25 * (arm.upper[1] - arm.lower[1])),
        high=float(arm.lower[1] + 0.75 * (arm.upper[1] - arm.lower[1])),
        covered=0.5,
        speed=1.0,
        speed_rms=0.5,
        acceleration_rms=2.0,
        slow=0.1,
        current_rms=3.0,
    )
    plot = motion_plot({"first": [motion] * arm.n, "second": [motion] * arm.n}, arm)
    assert [series.label for series in plot.series] == ["first", "second"]
    assert (plot.series[1].low[1], plot.series[1].high[1]) == pytest.approx((25.0, 75.0), rel=6e-5)  # five digits
    assert len({series.tone for series in plot.series}) == 2
