"""Shear and stretch between objects over time (thesis 3.1), a compact series for each pair seen together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ifsvideo.segmentation.shear import between_edges, shear_and_stretch
from ifsvideo.types import BACKGROUND, FramePoints, Scene, Tracks

EDGES = 10
"""Pairs of points between two objects, the nearest (`ifsvideo.segmentation.shear`)."""
_MOST_PAIRS = 48
"""Pairs of objects measured at one time, the nearest; more than ten objects in sight, and not all are."""
_LEAST_POINTS = 3


@dataclass(frozen=True)
class PairSeries:
    """Two objects over time; ``first`` is 0 where it is the background.

    Attributes
    ----------
    first, second : int
        Numbers of the objects, first < second.
    sample : (N,) uint32
        When, in steps of the sampling.
    shear : (N,) float32
        Mean absolute turn of the lines between their points, degrees per second.
    stretch : (N,) float32
        Mean absolute change of their lengths, pixels per second.
    """

    first: int
    second: int
    sample: NDArray[np.uint32]
    shear: NDArray[np.float32]
    stretch: NDArray[np.float32]


class Pairs:
    """Measures all pairs, a step at a time.

    Parameters
    ----------
    step_s : float
        Time between two steps, seconds.
    """

    def __init__(self, step_s: float) -> None:
        self._step_s = step_s
        self._before = FramePoints(np.empty(0, np.int64), np.empty((0, 2), np.float32))
        self._found: dict[tuple[int, int], list[tuple[float, float, float]]] = {}

    def add(self, sample: int, scene: Scene) -> None:
        """Take the next step; the points of a scene are ordered by id."""
        before = self._before.positions(scene.ids)
        known = np.isfinite(before).all(axis=1)
        ids, labels, now = scene.ids[known], scene.labels[known], scene.xy[known]
        self._before = FramePoints(scene.ids, scene.xy)
        groups = _groups(labels)
        if not groups:
            return
        tracks = Tracks.from_array(np.stack([before[known], now]), ids=ids)
        anchor = tracks.xy[0]
        for first, second in _nearest(groups, anchor):
            edges = between_edges(anchor, groups[first], groups[second], EDGES)
            shear, stretch = (float(change.mean()) for change in shear_and_stretch(tracks, edges))
            measured = (sample, np.degrees(shear) / self._step_s, stretch / self._step_s)
            self._found.setdefault((first, second), []).append(measured)

    def series(self, most: int) -> list[PairSeries]:
        """What was measured, by the objects' numbers: at most ``most`` values, of pairs longest together."""
        kept = []
        for pair, rows in sorted(self._found.items(), key=lambda item: (-len(item[1]), item[0])):
            most -= len(rows)
            if most < 0:
                break
            sample, shear, stretch = np.array(rows).T
            kept.append(
                PairSeries(
                    *pair, sample.astype(np.uint32), shear.astype(np.float32), stretch.astype(np.float32)
                )
            )
        return sorted(kept, key=lambda item: (item.first, item.second))


def _groups(labels: NDArray[np.int32]) -> dict[int, NDArray[np.int64]]:
    """Indices of the points of each object and of the background; nothing where there is no object."""
    found = {}
    for label in np.unique(labels[labels >= BACKGROUND]).tolist():
        members = np.flatnonzero(labels == label)
        if len(members) >= _LEAST_POINTS:
            found[label] = members
    return found if any(label > BACKGROUND for label in found) else {}


def _nearest(groups: Mapping[int, NDArray[np.int64]], anchor: NDArray[np.float64]) -> list[tuple[int, int]]:
    """The pairs to be measured: every object and the background, and objects near each other."""
    objects = [label for label in groups if label > BACKGROUND]
    pairs = [(BACKGROUND, label) for label in objects] if BACKGROUND in groups else []
    middle = np.array([anchor[groups[label]].mean(axis=0) for label in objects])
    first, second = np.triu_indices(len(objects), 1)
    order = np.argsort(cdist(middle, middle)[first, second], kind="stable")[:_MOST_PAIRS]
    return pairs + [(objects[a], objects[b]) for a, b in zip(first[order], second[order], strict=True)]
