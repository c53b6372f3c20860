"""Writes methods.md from the folders of comparisons, those that `rx90 compare ... --out FOLDER` left.

A comparison with methods from elsewhere goes into a section of its own, with whatever `check-*.md` its folder has: what
`rx90 compare --check METHOD --format markdown` said.
"""

import json
import sys
from pathlib import Path

from opening import write_page

HEAD = """# Methods side by side

Written by `make methods` from the folders of `rx90 compare`. No number is typed by hand.
"""
ELSEWHERE = """## External methods

What others offer, called by the adapters `docs/adapters/mujoco_sysid.py` and `docs/adapters/figaroh_tls.py`, which say
what each library does, what it lacks and what the adapter adds. Neither library is in the lock file; an adapter says
what to install. They are given the folders that every method here is given.

`mujoco.sysid` searches for the parameters of a simulation. Its deviations take residuals as white, and no payload as
weighed badly. Its modifier of a pseudo-inertia cannot be used in MuJoCo 4.0.0: the model that it leaves is refused with
"mass and inertia of moving bodies must be larger than mjMINVAL", so that the adapter sets the same inertia itself.
Its search, start and length of rows were settled on seed 0 of `nominal` and of `field`, which are among the trials
below; where the search has not ended after the adapter's number of steps every joint is refused, and more steps or a
coarser end might have given gains. Of what `rx90 compare --check` asks it was asked the first alone, exact gains of
exact data, and had not answered when its time was over. Times are of a machine that was busy with much else.

FIGAROH's `build_total_regressor_current` is total least squares without weights: `drive_gains` refuses what FIGAROH's
deviations say is unknown, `every_gain` tells whatever it states.
"""
KEY = "External methods"
"""Of what a report says about itself, if one of its methods is from elsewhere."""


def about(folder: Path) -> dict[str, str]:
    """What the report of a folder says about itself."""
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))["about"]


def section(folder: Path, depth: int = 1) -> str:
    """The report of a folder, and what was said of single methods, headings deeper by so much."""
    text = (folder / "report.md").read_text(encoding="utf-8")
    assert all(f"{key}: {value}." in text for key, value in about(folder).items()), (
        f"{folder}: report.md and report.json differ"
    )
    checked = [path.read_text(encoding="utf-8") for path in sorted(folder.glob("check-*.md"))]
    return "\n".join(deeper(each, depth) for each in (text, *checked))


def deeper(text: str, depth: int) -> str:
    """A text with its headings deeper by so much."""
    return "\n".join(f"{'#' * depth}{line}" if line.startswith("#") else line for line in text.splitlines()) + "\n"


def document(folders: list[Path], before: str) -> str:
    """All sections, those with methods from elsewhere last.

    Args:
        folders: Of comparisons.
        before: The document as it stands: of what no folder is given for, of ours or from elsewhere, it says the same.
    """
    ours = [folder for folder in folders if KEY not in about(folder)]
    theirs = [folder for folder in folders if folder not in ours]
    old, mark, foreign = before.partition(ELSEWHERE.splitlines()[0] + "\n")
    said = "\n".join(map(section, ours)) if ours else old[old.find("\n## ") + 1 :].rstrip("\n") + "\n"
    if theirs:
        return "\n".join([HEAD, said, ELSEWHERE, *(section(folder, 2) for folder in theirs)])
    return "\n".join([HEAD, said, *([mark + foreign] if mark else [])])


def main(folders: list[Path]) -> None:
    if not folders:
        sys.exit("name the folders of comparisons")
    path = Path(__file__).parent / "methods.md"
    write_page(path, document(folders, path.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
