"""Writes methods.md from the folders of comparisons, those that `rx90 compare ... --out FOLDER` left."""

import json
import sys
from pathlib import Path

HEAD = """# Methods side by side

Written by `make methods` from the folders that `rx90 compare` left. Nothing here is typed by hand.
"""


def section(folder: Path) -> str:
    """The report of a folder, its headings one deeper."""
    about = json.loads((folder / "report.json").read_text(encoding="utf-8"))["about"]
    text = (folder / "report.md").read_text(encoding="utf-8")
    deeper = "\n".join(f"#{line}" if line.startswith("#") else line for line in text.splitlines())
    assert all(f"{key}: {value}." in text for key, value in about.items()), (
        f"{folder}: report.md and report.json differ"
    )
    return deeper + "\n"


def main(folders: list[Path]) -> None:
    if not folders:
        sys.exit("name the folders of comparisons")
    text = "\n".join([HEAD, *map(section, folders)])
    (Path(__file__).parent / "methods.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
