"""How well points fit a static world if its cameras may give way to them.

The cameras are known from some points that are surely static. Far from these, nearer than they, or where the
camera hardly moved, they leave a camera some freedom, and what is static there seems to be off. So the points
in question are fitted together with them: one linear step of the adjustment in which the sure points hold
the cameras as firmly as they determine them. What moves by itself mostly stays off, but not always: things
that lie where nothing holds the cameras bend them to their own motion. The truth lies between.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.median import median
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
        self._freed = world.without_places()
        grant = world.bundle.tolerance * world.usual
        self._scale = 1 / (grant**2 * world.bundle.freedom)
        self._threshold = threshold
        few = core[:: 1 + (len(core) - 1) // REFIT_POINTS]
        sure, scale = self._freed.subset(few[None]), self._scale[few]
        square = sure.square() * scale
        self._held = sure.information(scale / (1 + square / _DOUBTFUL**2) ** 2)[0][0]
        lens = np.arange(-2, 0)
        self._held[lens, lens] += 1 / world.bundle.lens_spread**2

    def evidence(self, groups: Sequence[NDArray[np.int64]]) -> list[float]:
        """Median distance of each group's points (n,) from static points' ways, in the units of
        `World.evidence`, after the cameras gave way to them."""
        if not groups:
            return []
        sizes = [len(points) for points in groups]
        # As many of each, some more than once, which do not count.
        place = np.arange(max(sizes))
        padded = np.stack([points[place % len(points)] for points in groups])
        counts = place < np.array(sizes)[:, None]
        freed, scale = self._freed.subset(padded), self._scale[padded]
        square = freed.square() * scale
        typical = np.array([max(median(own[:size]), 1e-12) for own, size in zip(square, sizes, strict=True)])
        # Most of them decide; what fits worse than those is weighed down.
        weight = np.where(counts, scale, 0.0) / (1 + square / typical[:, None]) ** 2
        information, pull = freed.information(weight)
        held = self._held + information
        unknowns = np.arange(len(self._held))
        held[:, unknowns, unknowns] += _GAUGE * np.trace(held, axis1=1, axis2=2)[:, None] / len(unknowns)
        step = -np.asarray(np.linalg.solve(held, pull[..., None]), np.float64)[..., 0]
        after = freed.square(step) * scale
        return [
            float(np.sqrt(median(own[:size]))) / self._threshold
            for own, size in zip(after, sizes, strict=True)
        ]
