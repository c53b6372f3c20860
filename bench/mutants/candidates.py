"""Mutants: every small change that a tired colleague could have made, and a fixed random sample of them.

Strings, messages, annotations, imports, decorators and logging are left alone.
"""

import hashlib
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import unified_diff
from pathlib import Path

import libcst as cst
import libcst.matchers as m
from libcst.metadata import MetadataWrapper, PositionProvider

from bench.mutants.operators import OPERATORS


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A change that could be made.

    Attributes:
        path: Of the file, from the root of the project.
        line: Where the changed node starts.
        statement: First and last line of the statement around it; of a compound one, down to the changed node.
        at_import: Whether the line runs when the module is imported, instead of in a function.
        operator: What makes the change.
        key: What identifies the change whatever the line numbers are.
        module: The whole file.
        node: What is changed.
        mutated: What it becomes.
    """

    path: str
    line: int
    statement: tuple[int, int]
    at_import: bool
    operator: str
    key: str
    module: cst.Module
    node: cst.CSTNode
    mutated: cst.CSTNode


@dataclass(frozen=True, slots=True)
class Change:
    """Lines of a file before and after.

    Attributes:
        source: The whole file, changed.
        was: The lines that go, without indentation.
        now: The lines that come, without indentation.
    """

    source: str
    was: tuple[str, ...]
    now: tuple[str, ...]


def applied(candidate: Candidate) -> Change:
    """The file with one change made."""
    before = candidate.module.code
    after = cst.ensure_type(candidate.module.deep_replace(candidate.node, candidate.mutated), cst.Module).code
    lines = list(unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm=""))[3:]
    was = tuple(line[1:].strip() for line in lines if line.startswith("-"))
    return Change(after, was, tuple(line[1:].strip() for line in lines if line.startswith("+")))


def candidates(root: Path, path: str, leave_alone: Sequence[str]) -> list[Candidate]:
    """Every change that could be made to one file.

    Args:
        root: Folder of the project.
        path: Of the file, from there.
        leave_alone: Regular expressions of lines that are not changed.
    """
    wrapper = MetadataWrapper(cst.parse_module((root / path).read_text(encoding="utf-8")))
    visitor = _Visitor(path, wrapper.module)
    wrapper.visit(visitor)
    spared = re.compile("|".join(leave_alone) or r"(?!)")
    return [candidate for candidate in visitor.found if not spared.search(candidate.key.partition("\0")[0])]


def sample(found: Sequence[Candidate], *, count: int, seed: int) -> list[Candidate]:
    """A fixed random sample, one change a line at most.

    Lines are drawn by a hash of what they say, so that an edit of one line leaves the others where they are; then a
    kind of change for the line, then a change of that kind: long argument lists get no larger share.

    Args:
        found: Of one package.
        count: How many at most.
        seed: Another seed, another sample.
    """
    lines: dict[tuple[str, int], list[Candidate]] = defaultdict(list)
    for candidate in found:
        lines[candidate.path, candidate.line].append(candidate)

    def draw(*what: str) -> str:
        return hashlib.sha256("\0".join((str(seed), *what)).encode()).hexdigest()

    def rank(candidate: Candidate) -> tuple[str, str]:
        text = candidate.key.partition("\0")[0]
        return draw("kind", candidate.path, text, candidate.operator), draw("change", candidate.path, candidate.key)

    def place(line: list[Candidate]) -> str:
        return draw("line", line[0].path, line[0].key.partition("\0")[0])

    return [min(line, key=rank) for line in sorted(lines.values(), key=place)[:count]]


STRING = cst.SimpleString | cst.FormattedString | cst.ConcatenatedString
MAY_BE_QUIET = cst.Call | cst.If | cst.Assign | cst.AnnAssign | cst.BinaryOperation | cst.Expr | cst.Arg
LEFT_ALONE = STRING | cst.Annotation | cst.Import | cst.ImportFrom | cst.Decorator | cst.Raise
QUIET = (
    m.Call(func=m.Name("cast") | m.Attribute(value=m.Name("warnings") | m.Name("logging") | m.Name("logger")))
    | m.If(test=m.Name("TYPE_CHECKING"))
    | m.Assign(targets=[m.AssignTarget(m.Name("__all__"))])
    | m.AnnAssign(annotation=m.Annotation(m.Name("TypeAlias")))
    | m.BinaryOperation(operator=m.BitOr(), right=m.Name("None"))
    | m.Expr(m.Call(func=m.Attribute(value=m.Call(func=m.Attribute(value=m.Name("logging"))))))
    | m.Arg(keyword=m.Name("strict") | m.Name("dtype") | m.Name("encoding"))
)
"""Says something to a person or to the type checker, and nothing to the program."""


class _Visitor(cst.CSTVisitor):
    METADATA_DEPENDENCIES = (PositionProvider,)

    def __init__(self, path: str, module: cst.Module) -> None:
        super().__init__()
        self.found: list[Candidate] = []
        self._path, self._module, self._text = path, module, module.code.splitlines()
        self._statements: list[cst.CSTNode] = []
        self._functions = 0
        self._seen: dict[str, int] = defaultdict(int)

    def on_visit(self, node: cst.CSTNode) -> bool:
        if isinstance(node, LEFT_ALONE) or (isinstance(node, MAY_BE_QUIET) and m.matches(node, QUIET)):
            return False
        if isinstance(node, cst.BaseSmallStatement | cst.BaseCompoundStatement):
            self._statements.append(node)
        for kind, operator in OPERATORS:
            if isinstance(node, kind):
                for mutated in operator(node):
                    if not _only_text(node, mutated):
                        self._note(node, mutated, operator.__name__)
        self._functions += _step_in(node)
        return True

    def on_leave(self, original_node: cst.CSTNode) -> None:
        if self._statements and self._statements[-1] is original_node:
            self._statements.pop()
        self._functions -= _step_in(original_node)

    def _note(self, node: cst.CSTNode, mutated: cst.CSTNode, operator: str) -> None:
        here = self.get_metadata(PositionProvider, node)
        around = self._statements[-1]
        whole = self.get_metadata(PositionProvider, around)
        last = whole.end.line if isinstance(around, cst.BaseSmallStatement) else here.end.line
        if around is node and isinstance(node, cst.If):
            last = self.get_metadata(PositionProvider, node.test).end.line
        text = self._text[here.start.line - 1].strip()
        nth = sum(line.strip() == text for line in self._text[: here.start.line - 1])
        code = [self._module.code_for_node(n) for n in (node, mutated)]
        key = "\0".join((f"{text}#{nth}", operator, *code))
        self._seen[key] += 1
        self.found.append(
            Candidate(
                path=self._path,
                line=here.start.line,
                statement=(whole.start.line, last),
                at_import=self._functions <= 0,
                operator=operator,
                key=f"{key}\0{self._seen[key]}",
                module=self._module,
                node=node,
                mutated=mutated,
            )
        )


def _step_in(node: cst.CSTNode) -> int:
    """How much deeper in functions the inside of a node is: defaults are evaluated where the function is defined."""
    if isinstance(node, cst.FunctionDef):
        return 1
    return -1 if isinstance(node, cst.Parameters) else 0


def _only_text(node: cst.CSTNode, mutated: cst.CSTNode) -> bool:
    """Whether nothing but strings changes."""
    if isinstance(node, cst.Call) and isinstance(mutated, cst.Call):
        lost = [a for a in node.args if not any(a is b for b in mutated.args)]
        return any(isinstance(argument.value, STRING) for argument in lost)
    if isinstance(node, cst.BinaryOperation):
        return isinstance(node.left, STRING) or isinstance(node.right, STRING)
    return False
