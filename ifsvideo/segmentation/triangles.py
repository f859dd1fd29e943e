"""Many small symmetric systems at once: LAPACK takes them one by one and spends more time on each call than
on the work."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Triangles:
    """Symmetric positive matrices (N, N, ...) of a few rows, one for each of many points, as L L^T with
    triangles L (Cholesky)."""

    def __init__(self, V: Array) -> None:
        self._columns = V.shape[1:]
        self._L: list[list[Array]] = []
        for row in range(len(V)):
            L: list[Array] = []
            for column in range(row + 1):
                above = L if column == row else self._L[column]
                rest = V[row, column]
                for x, y in zip(L, above, strict=False):
                    rest = rest - x * y
                L.append(np.sqrt(rest) if column == row else rest / above[column])
            self._L.append(L)

    def halfway(self, right: Array) -> Array:
        """L^-1 times columns (N, ...), one or more for each matrix."""
        found = np.empty(np.broadcast_shapes(right.shape, self._columns))
        for row, L in enumerate(self._L):
            rest = right[row]
            for column in range(row):
                rest = rest - L[column] * found[column]
            np.divide(rest, L[row], out=found[row])
        return found

    def rest(self, half: Array) -> Array:
        """L^-T times columns (N, ...): what `halfway` left to do."""
        found = np.empty_like(half)
        for row in reversed(range(len(self._L))):
            rest = half[row]
            for below in range(row + 1, len(self._L)):
                rest = rest - self._L[below][row] * found[below]
            np.divide(rest, self._L[row][row], out=found[row])
        return found

    def solve(self, right: Array) -> Array:
        """Solutions (N, ...) for right sides (N, ...)."""
        return self.rest(self.halfway(right))
