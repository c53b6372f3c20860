"""Values of scenario tables: dataclasses whose annotated ranges are checked where they are made."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ident.support.arrays import Array
from ident.support.options import refuse_outside
from sim.errors import PlantError


@dataclass(frozen=True, kw_only=True)
class Values:
    """Base of model errors, sensors and controller options.

    Attributes:
        table: Name of the table of a scenario, for messages.

    Raises:
        PlantError: If a number is not finite or outside its annotated range.
    """

    table: ClassVar[str]

    def __post_init__(self) -> None:
        """Check the values."""
        refuse_outside(self, PlantError, self.table)


def each_value(values: Sequence[object], *names: str) -> list[Array]:
    """Return values of B simulations by name, each of shape (B, 1)."""
    return [np.array([[getattr(each, name)] for each in values]) for name in names]
