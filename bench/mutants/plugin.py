"""What pytest does differently for a mutant: the tests of a plan alone, in its order, each with a time limit.

With `MUTANTS_COVER` set it notes instead which lines each test runs, in this process and in those it starts.
"""

import json
import os
import resource
import signal
import sys
from collections.abc import Generator
from multiprocessing import forkserver
from pathlib import Path

import pytest

PLAN = "MUTANTS_PLAN"
"""Names a JSON file {"tests": {test: limit [s]}, "share": [k, n], "report": file}."""
COVER = "MUTANTS_COVER"
"""Names a JSON file for {test: names of its fixtures}."""
CONTEXT = "MUTANTS_CONTEXT"
"""The test that is running, for the processes it starts."""
MEMORY = 16 << 30
"""What a process may write to [bytes]: a mutant must not take the machine with it. Address space that is only reserved
does not count: the JavaScript engine that draws plots reserves more than any machine has."""
TOO_LONG = 99
"""Exit status of a test that passed its limit."""


class Plan:
    """Runs the tests of a plan and says how each ended."""

    def __init__(self, file: str) -> None:
        plan = json.loads(Path(file).read_text())
        self.limits: dict[str, float] = plan["tests"]
        self.share: list[int] = plan["share"]
        self.report = Path(plan["report"])
        self.seconds: dict[str, float] = {}
        self.failed: dict[str, str] = {}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if self.limits:
            rank = {test: number for number, test in enumerate(self.limits)}
            items[:] = sorted((item for item in items if item.nodeid in rank), key=lambda item: rank[item.nodeid])
        first, step = self.share
        items[:] = items[first::step]

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        def too_long(*_: object) -> None:
            self.failed[item.nodeid] = "passed its time limit"
            self.pytest_sessionfinish()
            os._exit(TOO_LONG)

        signal.signal(signal.SIGALRM, too_long)
        signal.setitimer(signal.ITIMER_REAL, self.limits.get(item.nodeid, 0.0))
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.failed:
            self.failed.setdefault(report.nodeid, _cause(report))

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.failed.setdefault(report.nodeid, _cause(report))

    def pytest_sessionfinish(self) -> None:
        self.report.write_text(json.dumps({"seconds": self.seconds, "failed": self.failed}))


class Contexts:
    """Names the running test to coverage. What a shared fixture or a cache has done once counts for all who use it."""

    def __init__(self, file: str) -> None:
        import coverage  # only this run needs it

        self.file = Path(file)
        self.now = coverage.Coverage.current()
        self.test = ""

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.file.write_text(json.dumps({item.nodeid: getattr(item, "fixturenames", []) for item in session.items}))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        self.test = item.nodeid
        self._switch(self.test)
        try:
            return (yield)
        finally:
            self._switch("")
            _forget()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[object]) -> Generator[None, object, object]:
        if fixturedef.scope == "function":
            return (yield)
        self._switch(f"fixture:{fixturedef.argname}")
        try:
            return (yield)
        finally:
            self._switch(self.test)

    def _switch(self, context: str) -> None:
        self.now.switch_context(context)
        os.environ[CONTEXT] = context


def pytest_configure(config: pytest.Config) -> None:
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, resource.getrlimit(resource.RLIMIT_DATA)[1]))
    config.pluginmanager.register(Plan(os.environ[PLAN]))
    if COVER in os.environ:
        config.pluginmanager.register(Contexts(os.environ[COVER]))


def _cause(report: pytest.TestReport | pytest.CollectReport) -> str:
    crash = getattr(report.longrepr, "reprcrash", None)
    text = crash.message if crash else str(report.longrepr)
    return next(iter(text.strip().splitlines()[:1]), "")[:160]


def _forget() -> None:
    """Empty our caches and end the process that workers are forked from: the next test starts its own."""
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] in ("ident", "sim", "scenarios"):
            for thing in list(vars(module).values()):
                if hasattr(thing, "cache_clear"):
                    thing.cache_clear()
    forkserver._forkserver._stop()
