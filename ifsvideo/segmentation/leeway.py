"""How well points fit a static world if its cameras may give way to them.

The cameras are known from some points that are surely static. Far from these, nearer than they, or where the
camera hardly moved, they leave a camera some freedom, and what is static there seems to be off. So the points
in question are fitted together with them: one linear step of the adjustment in which the sure points hold
the cameras as firmly as they determine them. What moves by itself mostly stays off, but not always: things
that lie where nothing holds the cameras bend them to their own motion. The truth lies between.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.world import REFIT_POINTS, World

Array = NDArray[np.float64]

_DOUBTFUL = 2.0
"""Error of a sure point, over what is usual, at which it holds the cameras with a quarter of its weight."""
_GAUGE = 1e-6
"""Share of the mean information that every unknown has at least: the world's scale is free."""


class Leeway:
    """The cameras' freedom in one world.

    Parameters
    ----------
    world : World
    core : (n,) int
        Points that are surely static, to which the world was fitted.
    threshold : float
        As of `World.evidence`.
    """

    def __init__(self, world: World, core: NDArray[np.int64], threshold: float) -> None:
        self._by_cameras, self._missed = world.without_places()
        grant = world.bundle.tolerance * world.usual
        self._scale = 1 / (grant * np.sqrt(world.bundle.freedom))
        self._threshold = threshold
        few = core[:: 1 + (len(core) - 1) // REFIT_POINTS]
        square = self._square(few, self._missed[few])
        self._held = self._information(few, 1 / (1 + square / _DOUBTFUL**2) ** 2)[0]
        lens = np.zeros(len(self._held))
        lens[-2:] = 1 / world.bundle.lens_spread**2
        self._held += np.diag(lens)

    def evidence(self, points: NDArray[np.int64]) -> float:
        """Median distance of some points (n,) from static points' ways, in the units of `World.evidence`,
        after the cameras gave way to them."""
        missed = self._missed[points]
        square = self._square(points, missed)
        # Most of them decide; what fits worse than those is weighed down.
        weight = 1 / (1 + square / max(float(np.median(square)), 1e-12)) ** 2
        information, pull = self._information(points, weight)
        held = self._held + information
        held += _GAUGE * np.trace(held) / len(held) * np.eye(len(held))
        after = missed - self._by_cameras[points] @ np.linalg.solve(held, pull)
        return float(np.sqrt(np.median(self._square(points, after)))) / self._threshold

    def _square(self, points: NDArray[np.int64], missed: Array) -> Array:
        """Mean square error of points (n,), in units of what is usual."""
        return np.asarray((missed**2).sum(axis=1) * self._scale[points] ** 2)

    def _information(self, points: NDArray[np.int64], weight: Array) -> tuple[Array, Array]:
        """What points tell of the cameras: matrix (N, N) and pull (N,) of the normal equations."""
        factor = (np.sqrt(weight) * self._scale[points])[:, None]
        rows = (self._by_cameras[points] * factor[..., None]).reshape(-1, self._by_cameras.shape[2])
        return rows.T @ rows, rows.T @ (self._missed[points] * factor).ravel()
