"""Columns of positions or currents in another order: two exchanged, all reversed, shifted or sorted by name."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ident.diagnosis.alternative import Alternative, in_logs, scopes
from ident.diagnosis.logs import Logs
from ident.model.arm import Arm
from ident.support.arrays import Indices


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Exchanges of positions, currents or both of two joints, in all logs or one; other orders in all logs."""
    arm = logs.structure.arm
    every = scopes(len(logs.recordings))
    for i, j in combinations(range(arm.n), 2):
        order = np.arange(arm.n)
        order[[i, j]] = j, i
        for scope in every:
            yield _ordered(logs, scope, order, f"{{}}{i + 1} and {{}}{j + 1} are exchanged", (i, j))
            yield _ordered(logs, scope, order, f"columns {{}}{i + 1} and {{}}{j + 1} are exchanged", (i, j), v=False)
            yield _ordered(logs, scope, order, f"columns {{}}{i + 1} and {{}}{j + 1} are exchanged", (i, j), q=False)
    for words, order in _other_orders(arm):
        yield _ordered(logs, every[0], order, f"columns {{}} are {words}", (), v=False)
        yield _ordered(logs, every[0], order, f"columns {{}} are {words}", (), q=False)
        yield _ordered(logs, every[0], order, f"{{}} are {words}", ())


def _ordered(
    logs: Logs,
    scope: tuple[int, ...],
    order: Indices,
    words: str,
    joints: tuple[int, ...],
    *,
    q: bool = True,
    v: bool = True,
) -> Alternative:
    fields = {name: order for name, wanted in (("q_order", q), ("v_order", v)) if wanted}
    what = "joints " if q and v else "q" if q else "v"
    words = words.replace("{}", what, 1).replace("{}", "" if q and v else what)
    return Alternative(
        family="order",
        words=in_logs(words.replace("joints  ", "the joints "), scope, logs.names),
        joints=joints,
        logs=scope,
        hypothesis=logs.given.changed(scope, **fields),
        advice="put the columns in the order of the model's joints",
    )


def _other_orders(arm: Arm) -> Iterator[tuple[str, Indices]]:
    each = np.arange(arm.n)
    by_name = sorted(range(arm.n), key=lambda j: arm.joint_names[j])
    known = {tuple(each.tolist())}
    for words, order in (
        ("in alphabetical order of the joints' names", np.argsort(by_name)),  # column of joint j
        ("in reverse order", each[::-1]),
        ("shifted by one place, the first joint last", np.roll(each, 1)),
        ("shifted by one place, the last joint first", np.roll(each, -1)),
    ):
        if tuple(order.tolist()) not in known and int(np.sum(order != each)) > 2:
            known.add(tuple(order.tolist()))
            yield words, order
