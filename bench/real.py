"""Recordings of real robots: writes docs/real-robots.md and its chart from a folder of downloads.

`recordings/sources.toml` says where recordings are from and what files are expected; sources without their files are
left out. Every number is from `rx90 identify` and `rx90 verify`, but slopes of torque sensors: sensor = slope * motor +
Fv dq + Fc sign(dq) + offset, by least squares.
"""

import argparse
import io
import json
import tomllib
from collections import defaultdict
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from itertools import pairwise, permutations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from scenarios.cli import main as command

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "real-robots.md"
METHODS = ("nls", "ls-2011", "iv")
TABLES = {
    "gains": ("Gains [N m/unit]", ("Recordings", "Joint")),
    "weights": ("Payloads weighed with gains [kg]", ("Payload of", "Gains", "Gains of", "Weighed", "Found")),
    "predictions": ("Currents outside the fit", ("Robot", "Fit", "Predicted, bare", "Method", "Error [% of rms]")),
    "ratios": ("Ratios of gains from bare motions", ("Robot", "Set", "Joint", "Over joint", "Ratio", "Published")),
    "sensors": ("Torque sensors", ("Joint", "Sensor", "Sensor per motor", "Residual [% of rms]")),
}
FOLD = '<details markdown="1"><summary>Currents outside the fit, ratios, torque sensors, sources</summary>\n\n'
Table = dict[str, Any]
Rows = list[list[object]]


def rx90(*words: object) -> Table:
    """The JSON object of a command; a refusal is an object with its sentence alone."""
    output, errors = io.StringIO(), io.StringIO()
    with redirect_stdout(output), redirect_stderr(errors):
        status = command([*map(str, words), "--json", "--quiet"])
    return {"refused": errors.getvalue().strip().splitlines()[-1]} if status == 2 else json.loads(output.getvalue())


def interval(value: float | None, std: float | None) -> str:
    return "-" if value is None or std is None else f"{value:.4g} ± {2.0 * std:.2g}"


@dataclass
class Board:
    """Rows of the page's tables; `drawn` has gains over published ones, and two deviations, by set."""

    folder: Path
    scratch: Path
    methods: Sequence[str]
    rows: dict[str, Rows] = field(default_factory=lambda: defaultdict(list))
    agreeing: dict[str, list[bool]] = field(default_factory=dict)
    drawn: dict[str, np.ndarray] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        here = HERE / "recordings" / name
        return here if here.exists() else self.folder / name

    def missing(self, source: Table) -> list[str]:
        sets = [each.get(key) for each in source.get("sets", []) for key in ("bare", "loaded", "payload")]
        names = [source.get("model"), source.get("sensors", {}).get("file"), *sets]
        return [name for name in names if name is not None and not self.path(name).exists()]

    def run(self, source: Table) -> None:
        """Fill in the rows of a source whose files are there."""
        if "sensors" in source:
            self.sense(source["sensors"])
        loaded = [each for each in source.get("sets", []) if "loaded" in each]
        for each in source.get("sets", []):
            if each not in loaded:
                self.compare_ratios(source, each)
        found = [[self.identify(source, each, method) for method in self.methods] for each in loaded]
        for each, answers in zip(loaded, found, strict=True):
            claims = [[(g["estimate"], g["std"]) for g in gains] for gains in answers]
            for j, (published, *own) in enumerate(zip(source["published"], *claims, strict=True), 1):
                self.rows["gains"].append(
                    [f"{source['name']}, {each['name']}", j, *(interval(*c) for c in own), published]
                )
            scale = np.array(source["published"])[:, None] / (1.0, 2.0)
            self.drawn[each["name"]] = np.array(claims[0], dtype=np.float64) / scale
        for one, other in pairwise(found):
            for method, a, b in zip(self.methods, one, other, strict=True):
                pairs = [(x, y) for x, y in zip(a, b, strict=True) if x["identifiable"] and y["identifiable"]]
                agree = [abs(x["estimate"] - y["estimate"]) <= 2.0 * np.hypot(x["std"], y["std"]) for x, y in pairs]
                self.agreeing.setdefault(method, []).extend(agree)
        for one, other in permutations(loaded, 2):
            for method in self.methods:
                self.try_on(source, one, other, method)

    def words(self, source: Table, each: Table) -> list[object]:
        words = ["--model", self.path(source["model"]), *source.get("words", []), "--unloaded", self.path(each["bare"])]
        if "loaded" in each:
            words += ["--loaded", self.path(each["loaded"]), "--payload", self.path(each["payload"])]
        return words

    def identify(self, source: Table, each: Table, method: str) -> list[Table]:
        """Gains of a set, one a joint; its payload is also weighed with the published gains."""
        out, published = self.scratch / f"{each['name']} {method}.toml", ",".join(map(str, source["published"]))
        more = "--method", method, "--gains-out", out, "--compare-with", published
        found = rx90("identify", *self.words(source, each), *more)
        if "refused" in found:
            return [{"estimate": None, "std": None, "identifiable": False} for _ in source["published"]]
        if method == self.methods[0]:
            stated, value, std = (found["cost"]["payload"][0][key] for key in ("stated", "assumed", "assumed_std"))
            self.rows["weights"].append([each["name"], "published", "-", stated, interval(value, std)])
        return found["gains"]

    def try_on(self, source: Table, one: Table, other: Table, method: str) -> None:
        """Weigh another set's payload with the gains of one, and predict its bare currents."""
        gains = self.scratch / f"{one['name']} {method}.toml"
        if not gains.exists():  # refused
            return
        found = rx90("verify", "--gains", gains, *self.words(source, other))
        whole = found.get("together", {"mass": None, "std": None})
        text = interval(whole["mass"], whole["std"])
        self.rows["weights"].append([other["name"], method, one["name"], found.get("mass", "-"), text])
        unseen = "--method", method, "--unseen", self.path(other["bare"])
        error = 100.0 * rx90("identify", *self.words(source, one), *unseen).get("unseen", {}).get("rel_error", np.nan)
        self.rows["predictions"].append([source["name"], one["name"], other["name"], method, f"{error:.1f}"])

    def compare_ratios(self, source: Table, each: Table) -> None:
        found = rx90("identify", *self.words(source, each))
        if "refused" in found:
            self.rows["ratios"].append([source["name"], each["name"], "-", "-", found["refused"], "-"])
        for joint in found.get("joints", []):
            j, reference, ratio = joint["joint"], found["reference"], joint["ratio"]
            published = source["published"][j - 1] / source["published"][reference - 1]
            text = interval(ratio, None if ratio is None else abs(ratio) * joint["rel_std"])
            if j != reference:
                self.rows["ratios"].append([source["name"], each["name"], j, reference, text, f"{published:g}"])

    def sense(self, columns: Table) -> None:
        data = pd.read_parquet(self.path(columns["file"]))
        for j in range(1, columns["joints"] + 1):
            for sensor in (name.format(j=j) for name in columns["columns"]):
                rows = data[[sensor, columns["motor"].format(j=j), columns["velocity"].format(j=j)]].dropna()
                torque, motor, dq = rows.to_numpy(dtype=np.float64).T
                Q, R = np.linalg.qr(np.column_stack((dq, np.sign(dq), np.ones(len(dq)), motor)))
                residual = torque - Q @ (Q.T @ torque)
                slope = Q[:, 3] @ torque / R[3, 3]
                std = np.linalg.norm(residual) / np.sqrt(len(dq) - 4) / abs(R[3, 3])
                sure = interval(slope, std) if std < 0.1 * abs(slope) else "-"
                share = 100.0 * np.linalg.norm(residual) / np.linalg.norm(torque)
                self.rows["sensors"].append([j, sensor, sure, f"{share:.0f}"])


def markdown(heads: Sequence[str], rows: Rows) -> str:
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in (heads, ["---"] * len(heads), *rows))


def table(title: str, heads: Sequence[str], rows: Rows) -> str:
    return f"## {title}\n\n{markdown(heads, rows)}\n\n" if rows else ""


def draw(drawn: dict[str, np.ndarray], method: str, path: Path) -> None:
    axis = (figure := Figure(figsize=(6.5, 3.2), layout="constrained")).subplots()
    for k, (name, points) in enumerate(drawn.items()):
        axis.errorbar(np.arange(1, len(points) + 1) + 0.12 * k, *points.T, fmt="o", capsize=3, label=name)
    axis.axhline(1.0, color="0.6", linewidth=0.8)
    axis.set(xlabel="Joint", ylabel="Identified over published gain", title=f"{method}, 2 sigma")
    axis.legend(frameon=False)
    figure.savefig(path, dpi=130)


def page(board: Board, sources: list[Table]) -> str:
    said = ", ".join(f"{sum(agree)} of {len(agree)} with `{name}`" for name, agree in board.agreeing.items())
    text = "# Real robots\n\n" + (f"**Gains of two days agree within 2 sigma on joints: {said}.**\n\n" if said else "")
    text += "Written by `make real` from recordings that others published; ± is two standard deviations.\n\n"
    text += "![Gains over published gains](real-robots.png)\n\n" if board.drawn else ""
    for name, (title, heads) in TABLES.items():
        text += FOLD if name == "predictions" else ""
        text += table(title, [*heads, *board.methods, "Published"] if name == "gains" else heads, board.rows[name])
    keys, heads = ("name", "source", "licence", "published_by", "get"), ("Recordings", "Source", "Licence")
    rows = [[*(each.get(key, "-") for key in keys), "no" if board.missing(each) else "yes"] for each in sources]
    return (
        text + table("Sources", (*heads, "Published gains", "How to get them", "In the tables"), rows) + "</details>\n"
    )


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="downloads")
    parser.add_argument("--method", action="append", help=f"repeatable (default {', '.join(METHODS)})")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page; its chart is written beside it")
    options = parser.parse_args(words)
    sources: list[Table] = tomllib.loads((HERE / "recordings" / "sources.toml").read_text(encoding="utf-8"))["source"]
    with TemporaryDirectory() as scratch:
        board = Board(options.folder, Path(scratch), options.method or METHODS)
        for source in (each for each in sources if not board.missing(each)):
            board.run(source)
    options.out.write_text(page(board, sources), encoding="utf-8")
    if board.drawn:
        draw(board.drawn, board.methods[0], options.out.with_suffix(".png"))


if __name__ == "__main__":
    main()
