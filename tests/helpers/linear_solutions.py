"""A weighted linear problem with beliefs: what tests compute of its solution can be computed again by refits."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ident.estimation.intervals import Basis, Rows


@dataclass(frozen=True)
class Linear:
    """Rows of two joints and two motions, of whose unknowns something is believed, with deviations of one."""

    W: np.ndarray
    V: np.ndarray
    weight: np.ndarray
    joint: np.ndarray
    motion: np.ndarray
    position: np.ndarray
    belief: np.ndarray  # rows over the unknowns
    believed: np.ndarray

    def fit(self, kept: np.ndarray, V: np.ndarray | None = None, more: np.ndarray | None = None) -> np.ndarray:
        """The unknowns that some rows give, with other currents, or beside columns of which nothing is believed."""
        V, W = self.V if V is None else V, self.W if more is None else np.column_stack((self.W, more))
        belief = np.pad(self.belief, ((0, 0), (0, W.shape[1] - self.W.shape[1])))
        X = np.vstack(((self.weight[:, None] * W)[kept], belief))
        return np.linalg.lstsq(X, np.concatenate(((self.weight * V)[kept], self.believed)))[0]

    def left(self, kept: np.ndarray, more: np.ndarray | None = None) -> np.ndarray:
        """What a fit of some rows leaves of all."""
        W = self.W if more is None else np.column_stack((self.W, more))
        return self.V - W @ self.fit(kept, more=more)

    @property
    def every(self) -> np.ndarray:
        return np.ones(len(self.V), dtype=bool)

    def blocks(self, first: int, lengths: tuple[int, ...], parts: int = 20) -> Iterator[np.ndarray]:
        """Rows of equal parts of each motion by time, the joints together; the position and lengths of motions."""
        for motion, length in enumerate(lengths):
            for k in range(parts):
                share = (self.position - first) * parts / length
                if (own := (self.motion == motion) & (share >= k) & (share < k + 1)).any():
                    yield own

    @property
    def rows(self) -> Rows:
        return Rows(
            V=self.V, residual=self.left(self.every), joint=self.joint, motion=self.motion, position=self.position,
            unknowns={int(j): 3.0 + k for k, j in enumerate(np.unique(self.joint))},
            weight=self.weight, explained=Basis.of(np.linalg.qr(self._whole)[0][: len(self.V)]),
        )  # fmt: skip

    @property
    def influence(self) -> np.ndarray:
        """Derivative of the unknowns by the currents."""
        return np.linalg.pinv(self._whole)[:, : len(self.V)] * self.weight

    @property
    def _whole(self) -> np.ndarray:
        return np.vstack((self.weight[:, None] * self.W, self.belief))
