"""Writes methods.md from the folders of comparisons, those that `rx90 compare ... --out FOLDER` left.

A comparison with external methods goes into a section of its own. Tables by joint stay in the folders.
"""

import json
import sys
from pathlib import Path

from opening import write_page

HEAD = """# Methods side by side

Written by `make methods` from the folders of `rx90 compare`.

Total least squares of the homogeneous equations of all joints (Gautier, Vandanjon et al. 2014) are not among the
methods: in five comparisons (`nominal`, `paper-noise`, `mass-only`, `field`, `coarse-encoder`, 20 trials each) they
gave 2 % of the gains at most and refused the others. They assume equal noise on all columns, and only the currents are
noisy. Ordinary least squares of the same equations gave gains that the noise of the currents makes too small, by up to
14 %.
"""
ELSEWHERE = """## External methods

Other libraries, called by the adapters `docs/adapters/mujoco_sysid.py` and `docs/adapters/figaroh_tls.py`, which say
what each library does, what it lacks and what the adapter adds. Neither library is in the lock file; an adapter says
what to install. They are given the folders that every method here is given.

`mujoco.sysid` searches for the parameters of a simulation. Its deviations take residuals as white and the payload as
exact. The search, its start and the length of rows were settled on seed 0 of `nominal` and of `field`, which are among
the trials below; where the search has not ended after the adapter's number of steps every joint is refused.

FIGAROH's `build_total_regressor_current` is total least squares without weights: `drive_gains` refuses gains with a
large deviation, `every_gain` returns all.
"""
EXTERNAL = "External methods"
"""Of what a report says about itself, if one of its methods is from elsewhere."""


def section(folder: Path) -> str:
    """The report of a folder without its tables by joint, headings one level deeper."""
    blocks = (folder / "report.md").read_text(encoding="utf-8").rstrip("\n").split("\n\n")
    by_joint = "| Method | Joint", "Bias, std:"
    kept = (f"#{each}" if each.startswith("#") else each for each in blocks if not each.startswith(by_joint))
    return "\n\n".join(kept) + "\n"


def document(folders: list[Path]) -> str:
    """All sections, comparisons with external methods last."""
    external = [EXTERNAL in json.loads((each / "report.json").read_text(encoding="utf-8"))["about"] for each in folders]
    ours, theirs = (
        [section(folder) for folder, other in zip(folders, external, strict=True) if other == wanted]
        for wanted in (False, True)
    )
    return "\n".join([HEAD, *ours, *([ELSEWHERE, *theirs] if theirs else [])])


if __name__ == "__main__":
    if not sys.argv[1:]:
        sys.exit("name the folders of comparisons")
    write_page(Path(__file__).parent / "methods.md", document([Path(word) for word in sys.argv[1:]]))
