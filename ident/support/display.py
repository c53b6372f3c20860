"""A result as a data frame, as a table in a notebook, and as a chart, from its columns."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class Displayed(ABC):
    """A result with columns, the first of which identifies a row; names end with the unit in brackets."""

    __slots__ = ()

    @abstractmethod
    def _columns(self) -> Mapping[str, Sequence[object]]:
        """Return the values of each column, None where there is none."""

    def _headline(self) -> str:
        """Return the main statement in a sentence."""
        return repr(self).partition("\n")[0]

    def to_frame(self) -> "pd.DataFrame":
        """Return the columns as a pandas DataFrame; names end with the unit in brackets, a relative value has none."""
        import pandas as pd  # optional

        return pd.DataFrame(self._columns())

    def plot(self) -> "Figure":
        """Return a Matplotlib figure of the second column, with two standard deviations where the third has these."""
        from matplotlib.figure import Figure  # optional

        (name, at), (y, values), (third, std), *_ = self._columns().items()
        unsure = third.startswith("std")
        bars = 2.0 * np.array(std, np.float64) if unsure else None  # None is NaN, and not drawn
        axes = (figure := Figure(figsize=(6.0, 3.0), layout="constrained")).subplots()
        axes.errorbar(list(map(str, at)), np.array(values, np.float64), bars, fmt="o", capsize=3.0)
        axes.set(title=self._headline(), xlabel=name, ylabel=y + (", 2 sigma" if unsure else ""))
        axes.set(xlim=(-0.5, len(at) - 0.5), ylim=(None if unsure else 0.0, None))  # with places of missing values
        return figure

    def _repr_html_(self) -> str:
        """Return main statement and columns for a notebook."""
        columns = self._columns()
        cells = [[_written(value) for value in row] for row in zip(*columns.values(), strict=True)]
        rows = [f"<tr>{''.join(f'<th>{escape(name)}</th>' for name in columns)}</tr>"]
        rows += [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in cells]
        return f"<p>{escape(self._headline())}</p><table>{''.join(rows)}</table>"


def _written(value: object) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
