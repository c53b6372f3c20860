"""Small changes to code that stay silent: nothing here only makes the program crash, which any test would notice.

mutmut's where it has them (`a < b` to `a <= b`, `+` to `-`, 1 to 2, `and` to `or`, True to False, ...); ours for a
dropped term, statement, condition, option or function, for arguments in the wrong order and for the wrong one of two.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import Any

import libcst as cst
from mutmut.mutation import mutators

PAIRS = (
    ("min", "max"),
    ("minimum", "maximum"),
    ("argmin", "argmax"),
    ("any", "all"),
    ("sin", "cos"),
    ("lower", "upper"),
    ("low", "high"),
    ("first", "last"),
    ("unloaded", "loaded"),
    ("rint", "floor"),
    ("ceil", "floor"),
    ("mean", "median"),
    ("zeros", "ones"),
    ("start", "stop"),
    ("value", "std"),
)
OTHER = {a: b for a, b in PAIRS} | {b: a for a, b in PAIRS}
FORGOTTEN = ("abs", "sqrt", "square", "deg2rad", "rad2deg", "sign", "sorted", "rint", "diag", "copy", "clip")
"""Functions whose first argument may pass for their result."""
SYMMETRIC = ("min", "max", "minimum", "maximum", "hypot", "add", "multiply", "array_equal", "allclose", "isclose")


def drop_term(node: cst.BinaryOperation) -> Iterator[cst.BaseExpression]:
    """`a + b` becomes `a`; so do difference, product and quotient."""
    if isinstance(node.operator, cst.Add | cst.Subtract | cst.Multiply | cst.Divide):
        yield node.left.with_changes(lpar=[*node.lpar, *node.left.lpar], rpar=[*node.left.rpar, *node.rpar])


def drop_statement(node: cst.Expr) -> Iterator[cst.Expr]:
    """A call whose result nobody uses is left out."""
    if isinstance(node.value, cst.Call):
        yield cst.Expr(cst.Ellipsis())


def drop_case(node: cst.If) -> Iterator[cst.If]:
    """The condition never holds."""
    yield node.with_changes(test=cst.Name("False"))


def drop_option(node: cst.Call) -> Iterator[cst.Call]:
    """`f(a, b=c)` becomes `f(a)`."""
    for k, argument in enumerate(node.args):
        if argument.keyword is not None and argument.keyword.value not in ("strict", "dtype", "encoding"):
            yield node.with_changes(args=[*node.args[:k], *node.args[k + 1 :]])


def drop_function(node: cst.Call) -> Iterator[cst.BaseExpression]:
    """`abs(a)` becomes `a`."""
    if _name_of(node.func) in FORGOTTEN and node.args and not node.args[0].star:
        value = node.args[0].value
        yield value.with_changes(lpar=[cst.LeftParen(), *value.lpar], rpar=[*value.rpar, cst.RightParen()])


def swap_arguments(node: cst.Call) -> Iterator[cst.Call]:
    """`f(a, b)` becomes `f(b, a)`."""
    for k, (a, b) in enumerate(pairwise(() if _name_of(node.func) in SYMMETRIC else node.args)):
        if not (a.value.deep_equals(b.value) or a.keyword or b.keyword or a.star or b.star):
            swapped = a.with_changes(value=b.value), b.with_changes(value=a.value)
            yield node.with_changes(args=[*node.args[:k], *swapped, *node.args[k + 2 :]])


def other_attribute(node: cst.Attribute) -> Iterator[cst.Attribute]:
    """`a.lower` becomes `a.upper`."""
    if node.attr.value in OTHER:
        yield node.with_changes(attr=cst.Name(OTHER[node.attr.value]))


def other_function(node: cst.Call) -> Iterator[cst.Call]:
    """`min(a)` becomes `max(a)`."""
    if isinstance(node.func, cst.Name) and node.func.value in OTHER:
        yield node.with_changes(func=cst.Name(OTHER[node.func.value]))


def other_argument(node: cst.Arg) -> Iterator[cst.Arg]:
    """`f(unloaded)` becomes `f(loaded)`."""
    if isinstance(node.value, cst.Name) and node.value.value in OTHER:
        yield node.with_changes(value=cst.Name(OTHER[node.value.value]))


OPERATORS: list[tuple[type[cst.CSTNode], Callable[[Any], Iterable[cst.CSTNode]]]] = [
    (cst.BaseNumber, mutators.operator_number),
    (cst.Name, mutators.operator_name),
    (cst.AugAssign, mutators.operator_augmented_assignment),
    (cst.UnaryOperation, mutators.operator_remove_unary_ops),
    (cst.Call, mutators.operator_symmetric_string_methods_swap),
    (cst.CSTNode, mutators.operator_keywords),
    (cst.CSTNode, mutators.operator_swap_op),
    (cst.IfExp, mutators.operator_if_exp),
    (cst.BinaryOperation, drop_term),
    (cst.Expr, drop_statement),
    (cst.If, drop_case),
    (cst.Call, drop_option),
    (cst.Call, drop_function),
    (cst.Call, swap_arguments),
    (cst.Attribute, other_attribute),
    (cst.Call, other_function),
    (cst.Arg, other_argument),
]


def _name_of(function: cst.BaseExpression) -> str | None:
    if isinstance(function, cst.Attribute):
        return function.attr.value
    return function.value if isinstance(function, cst.Name) else None
