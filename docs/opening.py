"""Opens pages of measurements with what came out, read from their own tables; alone it opens all that are there."""

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

HOME = Path(__file__).parent
Row = dict[str, str]


def tables(text: str) -> list[list[Row]]:
    """The tables of a page, a dict a row by the names of the columns."""
    found: list[list[Row]] = []
    for block in re.findall(r"(?:^\|.*\|\n)+", text, re.MULTILINE):
        head, _, *rows = ([cell.strip() for cell in re.split(r"(?<!\\)\|", line[1:-1])] for line in block.splitlines())
        found.append([dict(zip(head, row, strict=True)) for row in rows])
    return found


def numbers(texts: list[str]) -> list[float]:
    """The first number of each text that has one."""
    return [float(found[0]) for text in texts if (found := re.search(r"[\d.]+", text))]


def robots(text: str) -> str:
    rows = [row for row in tables(text)[0] if "%" in row["p95"]]
    joints, p95 = numbers([row["Joints"] for row in rows]), numbers([row["p95"] for row in rows])
    wrong, refused = (sum(numbers([row[key] for row in rows])) for key in ("Wrong", "Refused"))
    return (
        f"On {len(rows)} robots of {min(joints):g} to {max(joints):g} joints, 95 % of the gains of the worst joint are "
        f"within {min(p95):g} to {max(p95):g} %; {wrong:g} are wrong, {refused:g} that should be given are refused."
    )


def new_robot(text: str) -> str:
    rows = tables(text)[0]
    passed = [row for row in rows if row["Outcome"].startswith("passed")]
    refused = sum(row["Outcome"].startswith("refused") for row in rows)
    worst = max(numbers([row["Error"] for row in passed]))
    return (
        f"Of {len(rows)} model files {len(passed)} give a robot whose gains are identified within tolerance, the worst "
        f"within {worst:g} %; {refused} are refused with the reason."
    )


def protocols(text: str) -> str:
    key = "worst, 95 %"
    first, *others = tables(text)[0]
    best = min(others, key=lambda row: float(row[key]))
    return (
        f"{first['minutes']} minutes ({first['protocol']}) leave at most {first[key]} % on the worst joint in 95 % of "
        f"the trials; {best['minutes']} minutes ({best['protocol']}) leave {best[key]} %."
    )


def holds(text: str) -> str:
    said = list[str]()
    for protocol in ("motions", "holds"):
        rows = [row for row in tables(text)[0] if row["protocol"] == protocol]
        counts = [row["within 2 sigma"].split(" of ") for row in rows]
        inside, of = (sum(int(each[k]) for each in counts) for k in (0, 1))
        said.append(f"{protocol} give {of} gains, and 2 sigma contain the true value of {100.0 * inside / of:.0f} %")
    return f"On {len(rows)} robots, {' of them; '.join(said)} of them."


def excitation(text: str) -> str:
    less = numbers([row["Below random by"] for row in tables(text)[0]])
    return (
        f"With a searched motion, the worst joint has a standard deviation {min(less):g} to {max(less):g} % below "
        f"that of the best of 200 random motions."
    )


def payloads(text: str) -> str:
    shown = [re.findall(r"\d+", row["Joints shown"]) for row in tables(text)[0]]
    own, weight = (sum(each[k] == each[2] for each in shown) for k in (0, 1))
    return (
        f"A designed payload identifies every joint in {weight} of {len(shown)} scenarios, their own payloads in {own}."
    )


def verify(text: str) -> str:
    said, named = tables(text)
    within = " and ".join(f"{row['rms difference']} ({row['scenario']})" for row in said)
    large = [row for row in named if row["injected"] == named[-1]["injected"]]
    found, of = (sum(numbers([row[key] for row in large])) for key in ("named", "trials"))
    alarms, clean = (sum(int(row["false alarms"].split(" of ")[k]) for row in said) for k in (0, 1))
    return (
        f"The mass from one joint gives its gain's error within {within}; errors of {large[0]['injected']} are "
        f"named in {found:g} of {of:g} trials, {alarms} of {clean} verdicts on correct gains are false alarms."
    )


def error_budget(text: str) -> str:
    said = list[str]()
    for name, part in re.findall(r"^## (\S+), .*?$(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        (row,) = (row for table in tables(part) for row in table if "all together" in row.get("source", ""))
        errors = numbers([value for key, value in row.items() if key != "source"])
        said.append(f"{min(errors):g} to {max(errors):g} % on {name}")
    return f"All sources together leave each gain an error (rms) of {' and '.join(said)}."


def predicted_budget(text: str) -> str:
    cells = [cell for table in tables(text) for row in table for cell in row.values() if re.search(r"\d / ", cell)]
    differ = sum("**" in cell for cell in cells)
    agree = len(cells) - differ
    return f"Of {len(cells)} effects of a source on a joint, {agree} are predicted as simulated; {differ} differ."


def methods(text: str) -> str:
    ranked = [table for table in tables(text) if "Score [%]" in table[0]]
    best = Counter(
        row["Method"]
        for table in ranked
        for row in table
        if float(row["Score [%]"]) == max(numbers([each["Score [%]"] for each in table]))
    )
    (name, count), *_ = best.most_common(1)
    return f"`{name}` scores highest, or as high as any other, in {count} of {len(ranked)} comparisons."


RESULTS: dict[str, Callable[[str], str]] = {
    "robots.md": robots,
    "new-robot.md": new_robot,
    "protocols.md": protocols,
    "holds.md": holds,
    "excitation.md": excitation,
    "payloads.md": payloads,
    "verify.md": verify,
    "error-budget.md": error_budget,
    "predicted-budget.md": predicted_budget,
    "methods.md": methods,
}


def opened(name: str, text: str) -> str:
    """A page whose heading is followed by its result."""
    heading, _, rest = text.partition("\n\n")
    rest = re.sub(r"\A\*\*[^\n]*\*\*\n\n", "", rest)
    return f"{heading}\n\n**{RESULTS[name](text)}**\n\n{rest}"


def write_page(path: Path, text: str) -> None:
    path.write_text(opened(path.name, text), encoding="utf-8")


if __name__ == "__main__":
    for each in RESULTS:
        write_page(HOME / each, (HOME / each).read_text(encoding="utf-8"))
