"""The recipes of `docs/extending.md` as programs: what each section writes, changes and runs."""

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

from places import ROOT

PACKAGES = ("ident", "sim", "scenarios", "rx90_mjcf")
PAGE = ROOT / "docs" / "extending.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PLACE = re.compile(r"`([\w./]+\.\w+)`[^`]*\Z")
"""The last name in the text before a block."""


@dataclass
class Recipe:
    """One section: files it adds, differences it makes, files of the user's, each by path; and what it runs."""

    new: dict[str, str] = field(default_factory=dict)
    changes: dict[str, str] = field(default_factory=dict)
    own: dict[str, str] = field(default_factory=dict)
    commands: list[list[str]] = field(default_factory=list)


def _recipe(text: str) -> Recipe:
    found, before = Recipe(), 0
    for block in BLOCK.finditer(text):
        kind, content = block.groups()
        lead = text[before : block.start()].strip().splitlines()[-1] if kind != "sh" else ""
        before = block.end()
        if kind == "sh":
            found.commands.extend(shlex.split(line) for line in content.splitlines())
            continue
        place = PLACE.search(lead)
        assert place, f"a block of {kind} without a name above it: {content[:60]}"
        home = {"New: ": found.new, "In: `": found.changes}.get(lead[:5], found.own)
        assert (kind == "diff") == (home is found.changes), place[1]
        home[place[1]] = content
    return found


SECTIONS = re.split(r"^## (.+)\n", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
RECIPES = {title: _recipe(text) for title, text in zip(SECTIONS[1::2], SECTIONS[2::2], strict=True)}


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
