"""Every text that a user can meet, as the sources of `ident`, `sim` and `scenarios` write it.

A text is a literal of three words or more that is no docstring, annotation, assertion or name of a function to call.
`{...}` stands where a value is inserted. `tests/messages.txt` keeps them to be read as a whole:

    make messages
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SNAPSHOT = ROOT / "tests" / "messages.txt"
PACKAGES = ("ident", "sim", "scenarios")
WORDS = 3
SILENT_CALLS = {"TypeVar", "compile", "cast"}
"""Functions whose texts are for the interpreter: types and regular expressions."""


def messages(source: str) -> Iterator[str]:
    """The texts of a module in the order of its lines."""
    yield from dict.fromkeys(text for text in _texts(ast.parse(source)) if _words(text) >= WORDS)


def _texts(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.JoinedStr):
        yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{...}" for part in node.values)
        for part in node.values:
            yield from _texts(part.value) if isinstance(part, ast.FormattedValue) else ()
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    else:
        for child in ast.iter_child_nodes(node):
            if not _silent(node, child):
                yield from _texts(child)


def _silent(node: ast.AST, child: ast.AST) -> bool:
    """Whether nobody who runs the program reads the texts of a child."""
    if isinstance(child, ast.Assert):
        return True
    if isinstance(child, ast.Expr):
        return isinstance(child.value, ast.Constant)  # a docstring
    if isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in SILENT_CALLS:
        return True
    return child in (getattr(node, "annotation", None), getattr(node, "returns", None))


def _words(text: str) -> int:
    return len(re.findall(r"[A-Za-z]{2,}", text.replace("{...}", "")))


def snapshot() -> str:
    """All texts, file by file, one a line."""
    lines = list[str]()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            found = [text.strip().replace("\n", "\\n") for text in messages(path.read_text(encoding="utf-8"))]
            lines += ["", f"# {path.relative_to(ROOT).as_posix()}", *found] if found else []
    return "\n".join(lines[1:]) + "\n"


if __name__ == "__main__":
    SNAPSHOT.write_text(snapshot(), encoding="utf-8")
