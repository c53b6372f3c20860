"""The command as a process: streams that cannot be written, terminals, signals."""

import os
import signal
import subprocess
import sys
import time

import pytest
from signals import as_in_the_foreground

from scenarios.command_line.output import coloured, page


@pytest.mark.parametrize(
    ("environment", "terminal", "shown"),
    [
        ({"TERM": "xterm"}, True, True),
        ({"TERM": "xterm"}, False, False),
        ({"TERM": "dumb"}, True, False),
        ({"TERM": "xterm", "NO_COLOR": "1"}, True, False),
        ({"TERM": "xterm", "NO_COLOR": ""}, True, True),
        ({"FORCE_COLOR": "1"}, False, True),
        ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False, False),
    ],
)
def test_colours_are_for_terminals_that_have_them_unless_one_says_otherwise(environment, terminal, shown, monkeypatch):
    for name in ("TERM", "NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert coloured(terminal=terminal) is shown


@pytest.mark.parametrize(("columns", "width"), [("132", 132), ("40", 40), (None, 80)])
def test_what_is_piped_is_as_wide_as_what_a_terminal_of_that_width_shows(columns, width, monkeypatch):
    monkeypatch.delenv("COLUMNS")
    if columns is not None:
        monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr(sys, "__stdout__", None)  # what is asked is no terminal
    assert page().width == width


RX90 = f"{sys.executable} -m scenarios"


@pytest.mark.parametrize(
    ("line", "status", "error"),
    [
        (f"{RX90} list >/dev/full", 74, "rx90: standard output: No space left on device\n"),
        (f"{RX90} --help >/dev/full", 74, "rx90: standard output: No space left on device\n"),
        (f"{RX90} --version >/dev/full", 74, "rx90: standard output: No space left on device\n"),
        (f"{RX90} list >&-", 74, "rx90: standard output is closed\n"),
        (f"{RX90} run nominal >&-", 74, "rx90: standard output is closed\n"),
        (f"{RX90} lst 2>&-", 2, ""),
        (f"{RX90} list <&- >/dev/null", 0, ""),
        (f"{RX90} list >/dev/full 2>/dev/full", 74, ""),
        (f"(sleep 1; {RX90} list; echo $? >&2) | true", 0, "141\n"),
    ],
)
def test_streams_that_cannot_be_written_have_a_status_and_a_line(line, status, error):
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, error)


def test_a_terminal_that_knows_ascii_alone_gets_every_line(tmp_path):
    (tmp_path / "ä.toml").write_text('extends = "nope"\n')
    more = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    run = [sys.executable, "-m", "scenarios"]
    listed = subprocess.run([*run, "list"], capture_output=True, env=os.environ | more, check=False)
    words = [*run, "run", str(tmp_path / "ä.toml")]
    wrong = subprocess.run(words, capture_output=True, env=os.environ | more, check=False)
    assert (listed.returncode, listed.stderr) == (0, b"")
    assert wrong.returncode == 2
    assert wrong.stderr.count(b"\n") == 1


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_is_one_line_and_its_status(number, status, tmp_path):
    code = (
        "import sys, time\n"
        "import scenarios.commands.list as module\n"
        "from scenarios.cli import main\n"
        f"module.builtin_names = lambda: (open({str(tmp_path / 'there')!r}, 'w').close(), time.sleep(60))\n"
        "sys.exit(main(['list']))\n"
    )
    running = subprocess.Popen(
        [sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, preexec_fn=as_in_the_foreground
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "there").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.3)  # it sleeps by now
    running.send_signal(number)
    _, error = running.communicate(timeout=30.0)
    assert (running.returncode, error) == (status, "rx90: stopped\n")


def test_a_signal_that_is_ignored_stays_so(tmp_path):
    code = (
        "import os, signal\n"
        "import scenarios.commands.list as module\n"
        "from scenarios.cli import main\n"
        "names = module.builtin_names\n"
        "module.builtin_names = lambda: (os.kill(os.getpid(), signal.SIGHUP), names())[1]\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "raise SystemExit(main(['list']))\n"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0
