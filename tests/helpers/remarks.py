"""Remarks of a check by their topic."""

from collections.abc import Sequence

from ident.checks.remark import Remark


def told(remarks: Sequence[Remark], topic: str) -> Remark:
    (found,) = [each for each in remarks if each.topic == topic]
    return found
