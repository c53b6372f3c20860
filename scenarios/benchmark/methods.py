"""Methods of a comparison, built-in and external: each call has a process of its own, with limits.

    NAME, NAME,KEY=VALUE,...   an estimator of `ident`, with options of its own or of the identification
    package.module:function    takes a `GivenProblem`; returns a mapping per joint, `estimate` and `std`, or a `reason`
    exec: COMMAND              is given the problem's folder as its last argument

A process prints the gains as the JSON object of `rx90 identify --json`; methods in Python are run by this module as a
program. A call without a valid answer has a `ScenarioError`, which is counted.
"""

import hashlib
import json
import os
import pkgutil
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from functools import cache
from importlib.metadata import packages_distributions, version
from pathlib import Path
from types import ModuleType
from typing import IO, NamedTuple, cast

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.estimation.estimators import ESTIMATORS
from ident.estimation.problem import GainOptions
from ident.identification import identify
from ident.observation.observation import ObserveOptions
from ident.preparation import SIMULATED
from ident.support.errors import IdentificationError, OptionError
from ident.support.naming import nearest, one_line, shown
from ident.support.options import options_from_table, options_from_words, table_from_words
from scenarios.experiments.verdict import Claim
from scenarios.results.gains import Result
from scenarios.results.problem_folder import GivenProblem, read_problem
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import PACKAGES

Function = Callable[[GivenProblem], Sequence[Mapping[str, object]]]
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LARGEST_ANSWER, LARGEST_FILE = 10_000_000, 200_000_000
"""Largest number of bytes of an answer, and of any file that a method writes."""
TAIL = 4000
"""Number of bytes read from the end of standard error."""


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a comparison."""

    text: str
    words: tuple[str, ...]  # the command without its last argument, the problem's folder
    digests: tuple[tuple[str, str], ...] = ()  # of its files, and versions of packages that it imports, by name


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of one call: wall time with the start of the program [s], memory of each process on Linux [GB]."""

    time_s: float = 60.0
    memory_gb: float = 4.0


class Call(NamedTuple):
    """Outcome of a call, one answer per joint or the error, and its wall time with the start of the program [s]."""

    outcome: tuple[Claim, ...] | ScenarioError
    seconds: float


def method_of(text: str) -> Method:
    """Return the method of a text; raises `ScenarioError` without such an estimator, option, function or program."""
    if text.startswith("exec:"):
        try:
            words = shlex.split(text.removeprefix("exec:"))
        except ValueError as error:
            raise ScenarioError(f"method {shown(text)}: {str(error).lower()}") from error
        if not words:
            raise ScenarioError(f"method {shown(text)}: no command; expected exec: COMMAND")
        if (program := shutil.which(words[0])) is None:
            raise ScenarioError(f"method {shown(text)}: program not found: {shown(words[0])}")
        files = [Path(program), *(Path(word) for word in words[1:] if Path(word).is_file())]
        return Method(text, (str(Path(program).absolute()), *words[1:]), _digests(files))
    in_python = (sys.executable, "-P", "-m", "scenarios.benchmark.methods", text)
    if ":" not in text:
        _estimator(text, ObserveOptions(), GainOptions())
        return Method(text, in_python)
    module = sys.modules[_function(text).__module__]
    files = [] if getattr(module, "__file__", None) is None else [Path(str(module.__file__))]
    return Method(text, in_python, (*_digests(files), *imported_packages(module)))


def _estimator(
    text: str, observing: ObserveOptions, gains: GainOptions
) -> tuple[str, object, ObserveOptions, GainOptions]:
    """Return an estimator's name and options, and those of the identification, of which it may replace some."""
    name, *words = text.split(",")
    if name not in ESTIMATORS:
        raise ScenarioError(
            f"unknown method {shown(name)}{nearest(name, ESTIMATORS)}; known: {', '.join(ESTIMATORS)}, "
            "package.module:function, exec:COMMAND"
        )
    kinds = [{field.name for field in fields(kind)} for kind in (ObserveOptions, GainOptions)]
    parts: tuple[list[str], ...] = ([], [], [])
    for word in words:
        key = word.partition("=")[0].strip().replace("-", "_")
        parts[next((k for k, names in enumerate(kinds) if key in names), 2)].append(word)
    try:
        observing = options_from_table(ObserveOptions, asdict(observing) | table_from_words(ObserveOptions, parts[0]))
        gains = options_from_table(GainOptions, asdict(gains) | table_from_words(GainOptions, parts[1]))
        return name, options_from_words(ESTIMATORS[name].options, parts[2]), observing, gains
    except OptionError as error:
        raise ScenarioError(f"method {shown(text)}: {error}") from error


def _function(text: str) -> Function:
    """Import a function; the working folder is last in the search path, so that it hides no installed module."""
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        function = pkgutil.resolve_name(text)
    except (ImportError, AttributeError, ValueError) as error:
        raise ScenarioError(f"method {shown(text)}: {error}") from error
    if not callable(function):
        raise ScenarioError(f"method {shown(text)}: expected package.module:function, or exec:COMMAND")
    return cast(Function, function)


def _digests(paths: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    return tuple((path.name, hashlib.sha256(path.read_bytes()).hexdigest()[:16]) for path in paths)


def imported_packages(module: ModuleType) -> tuple[tuple[str, str], ...]:
    """Return name and version of each package that a module imports, without those that every study records."""
    values = vars(module).values()
    origins = (each.__name__ if isinstance(each, ModuleType) else getattr(each, "__module__", None) for each in values)
    tops = {origin.partition(".")[0] for origin in origins if isinstance(origin, str)}
    distributions = _distributions()
    named = {name for top in tops for name in distributions.get(top, ())} - set(PACKAGES)
    return tuple((name, version(name)) for name in sorted(named))


_distributions = cache(packages_distributions)  # it reads the files of every installed package, for a second


def call(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
    """Call a method. There is always an outcome, and all processes of its session are ended."""
    started = time.perf_counter()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        try:
            _run((*method.words, str(folder.absolute())), out, err, limits)
            out.seek(0)
            outcome = read_answer(out.read(), joints)
        except ScenarioError as error:
            outcome = error
    return Call(outcome=outcome, seconds=time.perf_counter() - started)


def _limiting(limits: Limits) -> Callable[[], None] | None:
    """Return what limits memory and files of the process that calls it, never above its own limits; None elsewhere."""
    if sys.platform != "linux":
        return None
    import resource

    allowed = {resource.RLIMIT_DATA: int(limits.memory_gb * 1e9), resource.RLIMIT_FSIZE: LARGEST_FILE}
    for kind, size in allowed.items():
        hard = resource.getrlimit(kind)[1]
        allowed[kind] = size if hard == resource.RLIM_INFINITY else min(size, hard)

    def limit() -> None:
        for kind, size in allowed.items():
            resource.setrlimit(kind, (size, size))

    return limit


def _run(words: Sequence[str], out: IO[bytes], err: IO[bytes], limits: Limits) -> None:
    """Run a program in a new session, which is ended with it; the system enforces limits, which children inherit."""
    environment = os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment["PYTHONWARNINGS"] = "ignore"
    try:
        process = subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True, env=environment,
            preexec_fn=_limiting(limits),  # a program that is limited later has already what it takes at its start
        )  # fmt: skip
    except OSError as error:
        raise ScenarioError(f"{one_line(words[0])}: {error.strerror}", kind="MethodNotStarted") from error
    try:
        status = process.wait(limits.time_s)
    except subprocess.TimeoutExpired:
        raise ScenarioError(f"no answer after {limits.time_s:g} s", kind="MethodTimedOut") from None
    finally:
        with suppress(ProcessLookupError, PermissionError):  # no process is left
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if out.seek(0, os.SEEK_END) > LARGEST_ANSWER:
        said = f"it printed more than {LARGEST_ANSWER // 10**6} MB; print one JSON object"
        raise ScenarioError(said, kind="NoAnswer")
    if not status:
        return
    err.seek(max(0, err.seek(0, os.SEEK_END) - TAIL))
    said = err.read().decode("utf-8", "replace").strip()
    last = one_line(said.splitlines()[-1]) if said else "it printed no message"
    if "MemoryError" in last or "bad_alloc" in said or "annot allocate memory" in last:
        raise ScenarioError(f"it requested more than {limits.memory_gb:g} GB: {last}", kind="MethodOutOfMemory")
    if status > 0:
        raise ScenarioError(f"exit status {status}: {last}", kind="MethodCrashed")
    name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
    raise ScenarioError(f"ended by {name}: {last}", kind="MethodCrashed")


class AnswerGain(BaseModel):
    """One joint's gain: `estimate`, and `std` if the method estimates one; null for a refused joint."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=False)
    joint: int = Field(ge=1)  # number of the joint, from 1
    estimate: float | None  # estimated gain [N m / drive unit], null if refused
    std: float | None  # standard deviation of the gain [N m / drive unit], null if refused or not estimated
    identifiable: bool  # whether there is a gain
    reason: str | None = None  # why there is no gain


class AnswerFile(BaseModel):
    """Output of a method: one gain per joint, in order; other keys are ignored."""

    model_config = ConfigDict(extra="allow")
    gains: list[AnswerGain]  # one entry per joint, in order


KINDS = {"json_invalid": "NoAnswer", "model_type": "NoAnswer", "finite_number": "NotFinite"}
"""Kind of an invalid answer by pydantic's type of error; all others are `WrongForm`."""


def read_answer(output: bytes, joints: int) -> tuple[Claim, ...]:
    """Return one answer per joint; raises `ScenarioError` of the kinds that `scenarios.support.errors` lists."""
    if not output.strip():
        raise ScenarioError("it printed nothing; expected one JSON object", kind="NoAnswer")
    try:
        gains = AnswerFile.model_validate_json(output, strict=True).gains
    except ValidationError as error:
        first = error.errors()[0]
        where, message = ".".join(map(str, first["loc"])), one_line(first["msg"][0].lower() + first["msg"][1:])
        said = f"{where}: {message}" if where else f"{message}; it printed {shown(output.decode(errors='replace'))}"
        raise ScenarioError(said, kind=KINDS.get(first["type"], "WrongForm")) from error
    if (numbers := [gain.joint for gain in gains]) != list(range(1, joints + 1)):
        said = f"gains of joints {shown(numbers)}; expected 1 to {joints}, in this order"
        raise ScenarioError(said, kind="WrongJoints")
    for gain in gains:
        value, std, refused = gain.estimate, gain.std, not gain.identifiable
        for wrong, said in (
            (refused and (value, std) != (None, None), "is refused but has a number; give null"),
            (not refused and not value, f"a gain of {value} is invalid; refuse the joint instead"),
            (std is not None and std < 0.0, f"a standard deviation of {std}"),
        ):
            if wrong:
                raise ScenarioError(f"joint {gain.joint}: {said}", kind="ImpossibleGain")
    return tuple(Claim(gain.estimate, gain.std, None if gain.identifiable else gain.reason) for gain in gains)


def python_answer(text: str, folder: Path) -> dict[str, object]:
    """Return the answer of an estimator or a function, not validated."""
    problem, started = read_problem(folder), time.perf_counter()
    try:
        if ":" not in text:
            name, own, observing, limits = _estimator(text, problem.observing, problem.gains)
            arm, motions = problem.arm, problem.motions
            found = identify(
                arm, motions, method=name, options=own, observing=observing, gains=limits, policy=SIMULATED
            )
            return Result.of_identification(found, time.perf_counter() - started).model_dump(mode="json")
        gains = _function(text)(problem)
    except IdentificationError as error:  # refused data mean that every joint is refused
        gains = [{"reason": str(error)}] * problem.arm.n
    none = {"std": None, "estimate": None, "reason": None}
    given = enumerate(gains, 1)
    return {"gains": [{"joint": j, **none, "identifiable": g.get("estimate") is not None, **g} for j, g in given]}


if __name__ == "__main__":  # standard output has the answer alone: what a method prints goes to standard error
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as answer:
        os.dup2(2, 1)
        json.dump(python_answer(sys.argv[1], Path(sys.argv[2])), answer)  # the reader refuses what is not finite
