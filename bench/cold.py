"""What a command costs a fresh process: CPU time and peak memory, and which libraries it imports; run by `make bench`.

CPU time is that of user and system together, and its ratio that to a process that imports NumPy, scipy.linalg,
Pinocchio and pyarrow.parquet alone; medians over rounds in which every command runs once. Modules are compiled before,
as they are where the package is installed, whatever the shell says about writing them.
"""

import os
import re
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import rx90_mjcf

ROUNDS = 7
LIBRARIES = 8
"""Libraries that are printed of a command."""
REFERENCE = ("-c", "import numpy, scipy.linalg, pinocchio, pyarrow.parquet")
IMPORT = re.compile(r"import time:\s+(\d+) \|\s+\d+ \|\s+(\w+)")


@dataclass(frozen=True, slots=True)
class Cost:
    """CPU time [s] and peak memory [MB] of a process."""

    cpu: float
    memory: float


def cost(arguments: Sequence[str]) -> Cost:
    """Run a fresh Python; a missed tolerance is no failure."""
    process = subprocess.Popen((sys.executable, *arguments), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert os.waitstatus_to_exitcode(status) in (0, 1), arguments
    return Cost(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def imports(arguments: Sequence[str]) -> Counter[str]:
    """Time that the modules of each library take to import [s], nested imports counted where they belong."""
    done = subprocess.run((sys.executable, "-X", "importtime", *arguments), capture_output=True, text=True, check=False)
    found: Counter[str] = Counter()
    for line in done.stderr.splitlines():
        if each := IMPORT.match(line):
            found[each[2]] += int(each[1]) / 1e6
    return found


def commands(cell: Path) -> dict[str, tuple[str, ...]]:
    """Commands on a pair of recordings in Parquet."""
    payload = ("--loaded", f"{cell}/loaded.parquet", "--payload", f"{cell}/payload.toml")
    calls = {
        "identify": ("--model", str(rx90_mjcf.MJCF), "--unloaded", f"{cell}/unloaded.parquet", *payload),
        "run": ("nominal",),
        "predict": ("nominal",),
        "check": ("rx90", f"{cell}/unloaded.parquet", *payload),
    }
    return {name: ("-m", "scenarios", name, *words, "--quiet") for name, words in calls.items()}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell"
        os.environ["PYTHONPYCACHEPREFIX"] = f"{folder}/compiled"
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        cost(("-m", "scenarios", "run", "nominal", "--save", str(cell), "--quiet"))
        calls = commands(cell)
        for words in (REFERENCE, *calls.values()):
            cost(words)
        rounds = [(cost(REFERENCE), {name: cost(words) for name, words in calls.items()}) for _ in range(ROUNDS)]
        print(f"cold imports alone: {statistics.median(base.cpu for base, _ in rounds):.2f} s CPU")
        for name, words in calls.items():
            cpu = statistics.median(each[name].cpu for _, each in rounds)
            ratio = statistics.median(each[name].cpu / base.cpu for base, each in rounds)
            peak = max(each[name].memory for _, each in rounds)
            print(f"cold `rx90 {name}`: {cpu:.2f} s CPU, {ratio:.2f} times imports alone, peak memory {peak:.0f} MB")
            found = imports(words)
            most = ", ".join(f"{library} {1e3 * took:.0f} ms" for library, took in found.most_common(LIBRARIES))
            print(f"  imports {found.total():.2f} s: {most}")
