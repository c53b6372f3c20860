from collections.abc import Sequence
from pathlib import Path

import pytest

pytest.importorskip("mutmut", reason="what changes code is a tool of development")

import bench.mutants.__main__ as program
from bench.mutants.candidates import Candidate, applied, candidates, sample
from bench.mutants.report import equivalents, outdated
from bench.mutants.trial import Ran, Reach, ended

CODE = '''"""Module."""

import math
from typing import TYPE_CHECKING, TypeAlias, cast

if TYPE_CHECKING:
    from collections.abc import Sequence

Pair: TypeAlias = tuple[int, int | None]
__all__ = ["area"]


class Wrong(Exception):
    """Never 3 + 4."""


def area(sides: "Sequence[float]", *, limit: float | None = None) -> float:
    """The product, 2 * 3."""
    if limit is None:
        raise Wrong(f"{sides[0] * 5} is too much" + str(7))
    return cast("float", sides[0] * sides[1])
'''


@pytest.fixture
def mutants(tmp_path: Path):
    def made(code: str, leave_alone: Sequence[str] = ()) -> list[Candidate]:
        (tmp_path / "code.py").write_text(code)
        return candidates(tmp_path, "code.py", leave_alone)

    return made


def lines(found: Sequence[Candidate]) -> set[str]:
    return {"\n".join(applied(candidate).now) for candidate in found}


def names(found: Sequence[Candidate]) -> set[tuple[str, str]]:
    return {(candidate.path, candidate.key) for candidate in found}


@pytest.mark.parametrize(
    ("code", "changed"),
    [
        ("y = a < b", {"y = a <= b"}),
        ("y = a - b", {"y = a + b", "y = a"}),
        ("y = (a + b) * c", {"y = (a - b) * c", "y = (a) * c", "y = (a + b) / c", "y = (a + b)"}),
        ("y = a is None", {"y = a is not None"}),
        ("y += b", {"y -= b", "y = b"}),
        ("y = x[0]", {"y = x[1]"}),
        ("y = not a", {"y = a"}),
        ("y = a and b", {"y = a or b"}),
        ("y = a if b else c", {"y = a if (b) and False else c", "y = a if (b) or True else c"}),
        ("f(a, b)", {"f(b, a)", "..."}),
        ("y = f(a, b=c)", {"y = f(a, )"}),
        ("y = max(a, b)", {"y = min(a, b)"}),
        ("y = np.abs(a)", {"y = (a)"}),
        ("y = f(a.lower)", {"y = f(a.upper)"}),
        ("y = f(unloaded)", {"y = f(loaded)"}),
        ("if a:\n    y = b", {"if False:"}),
    ],
)
def test_a_change_is_one_that_a_tired_colleague_could_make(mutants, code, changed):
    assert lines(mutants(code)) == changed


def test_what_only_people_and_type_checkers_read_is_left_alone(mutants):
    assert lines(mutants(CODE)) == {"if limit is not None:", "if False:"}


def test_lines_that_the_configuration_spares_are_left_alone(mutants):
    assert lines(mutants("y = a + b\naxis.grid(a + b)\n", [r"\baxis\."])) == {"y = a - b", "y = a"}


def test_what_runs_when_the_module_is_imported_is_told_from_what_a_test_runs(mutants):
    found = mutants("A = 2\n\ndef f(x=3):\n    return x + 4\n\nclass C:\n    b = 5\n")
    assert {candidate.line: candidate.at_import for candidate in found} == {1: True, 3: True, 4: False, 7: True}


def test_a_change_is_reached_by_any_line_of_its_statement_but_not_by_the_block_below_it(mutants):
    found = mutants(
        "def f(x):\n    y = g(\n        x,\n        b=2,\n    )\n    if (\n        y < 3\n    ):\n        return y\n"
    )
    assert {c.line: c.statement for c in found if c.operator == "operator_number"} == {4: (2, 5), 7: (6, 7)}


def test_the_same_code_gives_the_same_sample_and_another_seed_another(mutants):
    code = "".join(f"y{k} = a{k} - b{k}\n" for k in range(40))
    first = sample(mutants(code), count=12, seed=3)
    assert names(first) == names(sample(mutants(code), count=12, seed=3))
    assert names(first) != names(sample(mutants(code), count=12, seed=4))
    assert len({candidate.line for candidate in first}) == 12


def test_an_edit_of_a_line_leaves_the_rest_of_the_sample_as_it_was(mutants):
    code = "".join(f"y{k} = a{k} - b{k}\n" for k in range(40))
    before = sample(mutants(code), count=12, seed=3)
    edited = code.replace(f"y{before[0].line - 1} =", "z =")
    assert len(names(before) & names(sample(mutants("\n\n" + edited), count=12, seed=3))) >= 11


def test_an_equivalent_is_found_whatever_its_indentation_and_told_when_its_line_has_gone(tmp_path, mutants):
    (tmp_path / "known.toml").write_text(
        '[[equivalent]]\nfile = "code.py"\nwas = "return a - b"\nnow = "return a + b"\nreason = "b is nothing"\n'
    )
    known = equivalents(tmp_path / "known.toml")
    changes = [applied(candidate) for candidate in mutants("def f(a, b):\n    return a - b\n")]
    found = [known.get(("code.py", "\n".join(change.was), "\n".join(change.now))) for change in changes]
    assert sorted(found, key=str) == [None, "b is nothing"]
    assert outdated(known, tmp_path) == []
    (tmp_path / "code.py").write_text("c = 3\n")
    assert outdated(known, tmp_path) == ["listed as equivalent, no longer in code.py: return a - b"]


def unchanged(monkeypatch, *statuses: int | None):
    """The unchanged run where every copy's ends with a status; with 0 it has one test."""

    def trace(_folder, _at, *, share, seconds):
        k = share[0]
        return Ran(statuses[k], {f"test-{k}": 0.3} if statuses[k] == 0 else {}, {}, "said"), Reach({})

    monkeypatch.setattr(program, "trace", trace)
    return program._unchanged([Path(str(k)) for k in range(len(statuses))], ["tests/one.py"])


def test_a_copy_without_a_test_of_its_own_is_no_fault(monkeypatch):
    assert unchanged(monkeypatch, 0, 5)[0] == {"test-0": 0.3}
    with pytest.raises(SystemExit, match=r"^no test of tests/one\.py passes unchanged$"):
        unchanged(monkeypatch, 5, 5)


@pytest.mark.parametrize(
    ("status", "words"),
    [(None, "pytest had not ended after 1800 s"), (-9, "signal 9 ended pytest"), (4, "pytest ended with status 4")],
)
def test_how_an_unchanged_run_ended_is_told(monkeypatch, status, words):
    assert ended(status, 1800.0) == words
    monkeypatch.setattr(program, "WHOLE_SUITE", 1800.0)
    with pytest.raises(SystemExit, match=f"^the tests do not run unchanged: {words}\nsaid"):
        unchanged(monkeypatch, 0, status)
