"""The suite against the newest dependencies: which differ from `requirements.lock`, and which tests fail with them."""

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
PINNED = re.compile(r"^([A-Za-z0-9._-]+)==([^ \\;]+)", re.MULTILINE)


def newer(lock: str) -> dict[str, tuple[str, str]]:
    """Packages of another version than the lock's: that one, and the one that is here."""
    found = dict[str, tuple[str, str]]()
    for name, pinned in PINNED.findall(lock):
        try:
            here = version(name)
        except PackageNotFoundError:  # of another platform
            continue
        if here != pinned:
            found[name] = pinned, here
    return found


def failures(report: Path) -> list[str]:
    """Names of tests that failed, with the first line of why."""
    found = list[str]()
    for case in ET.parse(report).iter("testcase"):
        for fault in (*case.findall("failure"), *case.findall("error")):
            why = (fault.get("message") or "").splitlines() or [""]
            found.append(f"{case.get('classname')}.{case.get('name')}: {why[0][:160]}")
    return found


def main(words: list[str]) -> int:
    """Run the tests that are named, all without a name; 1 if one fails."""
    changed = newer((ROOT / "requirements.lock").read_text(encoding="utf-8"))
    print(f"{len(changed)} packages differ from requirements.lock:")
    for name, (pinned, here) in changed.items():
        print(f"  {name} {pinned} -> {here}")
    with TemporaryDirectory() as place:
        report = Path(place) / "report.xml"
        done = subprocess.run([sys.executable, "-m", "pytest", "-q", f"--junitxml={report}", *words], cwd=ROOT)
        broken = failures(report) if report.exists() else ["the tests did not start"]
    print(f"{len(broken)} tests fail with the newest packages" + (":" if broken else "."))
    for each in broken:
        print(f"  {each}")
    return int(bool(broken) or done.returncode not in (0, 5))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
