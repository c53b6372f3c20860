"""The recipes of `docs/extending` as programs: what each writes, changes and runs."""

import os
import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

from one_process import Outcome, carried_out
from places import ROOT

from scenarios.__main__ import ONE_THREAD

PACKAGES = ("ident", "sim", "scenarios", "rx90_mjcf")
INDEX = ROOT / "docs" / "extending.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PLACE = re.compile(r"`([\w./]+\.\w+)`[^`]*\Z")
"""The last name in the text before a block."""


@dataclass(frozen=True)
class Recipe:
    """One section.

    Attributes:
        title: Its heading.
        new: Files it adds, by path.
        changes: Differences it makes, by path.
        own: Files of the user's, by path.
        commands: What it runs.
        cost: Files that the table of the index says it touches; 0 for a folder.
    """

    title: str
    new: dict[str, str]
    changes: dict[str, str]
    own: dict[str, str]
    commands: list[list[str]]
    cost: int


def _recipe(page: Path, cost: int) -> Recipe:
    heading, _, text = page.read_text(encoding="utf-8").partition("\n")
    title = heading.removeprefix("# ")
    found = Recipe(title, {}, {}, {}, [], cost)
    before = 0
    for block in BLOCK.finditer(text):
        kind, content = block.groups()
        lead = text[before : block.start()].strip().splitlines()[-1] if kind != "sh" else ""
        before = block.end()
        if kind == "sh":
            found.commands.extend(shlex.split(line) for line in content.splitlines())
            continue
        place = PLACE.search(lead)
        assert place, f"{title}: a block of {kind} without a name above it"
        home = {"New: ": found.new, "In: `": found.changes}.get(lead[:5], found.own)
        assert (kind == "diff") == (home is found.changes), f"{title}: {place[1]}"
        home[place[1]] = content
    return found


def _recipes() -> dict[str, Recipe]:
    """By kind, as the table of the index names page and number of files."""
    text = INDEX.read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[([\w ]+)\]\((extending/[\w-]+\.md)\) \| (\w+| ?a folder) \|", text, re.MULTILINE)
    return {name: _recipe(INDEX.parent / page, int(cost) if cost.isdigit() else 0) for name, page, cost in rows}


RECIPES = _recipes()


def copy_of_packages(folder: Path) -> Path:
    """The packages as they are, compiled modules included."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name)
    return folder


def patched(text: str, change: str) -> str:
    """The text with a difference applied; the lines that stay and those that go are found exactly once."""
    for hunk in re.split(r"^@@\n", change, flags=re.MULTILINE):
        lines = hunk.splitlines(keepends=True)
        assert {line[0] for line in lines} <= set(" +-"), hunk
        old = "".join(line[1:] for line in lines if line[0] != "+")
        assert f"\n{text}".count(f"\n{old}") == 1, f"not there once:\n{old}"
        text = text.replace(old, "".join(line[1:] for line in lines if line[0] != "-"))
    return text


def follow(recipe: Recipe, packages: Path, work: Path) -> None:
    """Write and change what the recipe says: of the packages in `packages`, anything else in `work`."""
    for place, content in [*recipe.new.items(), *recipe.own.items()]:
        path = (packages if place.startswith(PACKAGES) else work) / place
        assert not path.exists(), f"{place} is there already"
        path.parent.mkdir(exist_ok=True)  # a new folder of its own, in one that exists
        path.write_text(content)
    for place, change in recipe.changes.items():
        path = packages / place
        path.write_text(patched(path.read_text(), change))


def touched(packages: Path) -> set[str]:
    """Files of a copy that are new, gone or other than ours."""

    def contents(root: Path) -> dict[str, bytes]:
        paths = [p for name in PACKAGES for p in (root / name).rglob("*") if p.is_file() and p.suffix != ".pyc"]
        return {p.relative_to(root).as_posix(): p.read_bytes() for p in paths}

    ours, theirs = contents(ROOT), contents(packages)
    return {place for place in ours.keys() | theirs.keys() if ours.get(place) != theirs.get(place)}


def environment(packages: Path) -> dict[str, str]:
    """For a process that imports a copy of the packages; on one thread, as the command `rx90` is."""
    return {**os.environ, "PYTHONPATH": str(packages), **dict.fromkeys(ONE_THREAD, "1")}


def run(commands: list[list[str]], packages: Path, work: Path) -> list[Outcome]:
    """Write the schemas as `make schemas` does, then run commands, one after the other in one process."""
    schemas = "from scenarios.json_schemas import write_schemas; write_schemas()"
    return carried_out(commands, work, before=schemas, environment=environment(packages))
