"""One sequence looked into: what each stage made of its points, and the shear between two segments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark.metrics import matching
from ifsvideo.segmentation.refinement import delaunay_edges
from ifsvideo.segmentation.shear import between_edges, inside_edges, shear_and_stretch
from ifsvideo.types import Segmentation, Tracks

Groups = NDArray[np.int64]
"""Group of each point (P,): 0 the background or none in particular, -1 not part of the stage."""
_PAIRS = 10
"""Point pairs between two segments, as many as the segmenter's default."""
_LEAST_POINTS = 4
"""Points of a segment worth a curve."""


@dataclass(frozen=True)
class Pair:
    """Two segments, and how the edges within and between them changed.

    Attributes
    ----------
    title : str
    members : two of (n,) int64, indices of points
    shear, stretch : mapping of "between", "inside first", "inside second" to (F-1,) float
        Sum over the frames so far of the mean change of an edge: of orientation, degrees, and of length,
        pixels, absolute values.
    """

    title: str
    members: tuple[Groups, Groups]
    shear: dict[str, NDArray[np.float64]]
    stretch: dict[str, NDArray[np.float64]]


def base_frame(tracks: Tracks) -> int:
    """Frame in which most points are seen."""
    return int(np.argmax(tracks.visible.sum(axis=1)))


def anchors(tracks: Tracks) -> NDArray[np.float64]:
    """Place (P, 2) of each point in the base frame, or its mean where it is not seen there; NaN if never."""
    seen = tracks.visible[..., None]
    mean = np.where(seen, tracks.xy, 0).sum(axis=0) / np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
    base = base_frame(tracks)
    place: NDArray[np.float64] = np.where(tracks.visible[base, :, None], tracks.xy[base], mean)
    return place


def groups_by_stage(segmentation: Segmentation, truth: Groups) -> dict[str, Groups]:
    """Groups after each stage, in their order; a stage that left nothing behind is not there, as where tracks
    were segmented window by window."""
    stages: dict[str, Groups] = {}
    if (segmentation.segments >= 0).any():
        stages["1 split: static or not"] = np.where(segmentation.background, 0, 1)
        start = _of_all_points(segmentation, "start")
        if start is not None:
            stages["3 start: a model for each point"] = _numbered(start)
        stages["4 refined segments"] = _numbered(segmentation.segments)
    stages["5 merged"] = segmentation.labels
    stages["truth"] = _as_found(truth, segmentation.labels)
    return stages


def _of_all_points(segmentation: Segmentation, key: str) -> Groups | None:
    """What a stage kept for each usable point, as groups of all points; None where it kept no such thing."""
    kept = segmentation.details.get(key)
    points = len(segmentation.labels)
    usable = np.asarray(segmentation.details.get("usable", np.arange(points)))
    if kept is None or np.shape(kept) != usable.shape:
        return None
    groups = np.full(points, -1, dtype=np.int64)
    groups[usable] = kept
    return groups


def _as_found(truth: Groups, labels: Groups) -> Groups:
    """True groups under the numbers of the labels that match them best, further ones under numbers of their
    own; -1 where not known."""
    known = (truth > 0) & (labels >= 0)
    numbers = matching(labels[known], truth[known])
    free = int(labels.max(initial=0)) + 1
    for place, group in enumerate(np.setdiff1d(truth[truth > 0], list(numbers))):
        numbers[int(group)] = free + place
    return np.array([numbers.get(int(group), -1) for group in truth], dtype=np.int64)


def _numbered(groups: Groups) -> Groups:
    """Groups numbered 1, 2, ... by size, -1 kept."""
    numbers, place, counts = np.unique(groups, return_inverse=True, return_counts=True)
    order = np.argsort(np.where(numbers < 0, 1, -counts), kind="stable")
    rank = np.where(numbers < 0, -1, np.argsort(order) + 1)
    return rank[place].astype(np.int64)


def pairs_of_segments(tracks: Tracks, segmentation: Segmentation) -> list[Pair]:
    """Two neighbouring segments that stayed apart, and two that were merged, where there are such.

    Of the candidates those are taken whose smaller one is largest; of several, those whose centres are
    nearest.
    """
    place = anchors(tracks)
    found: dict[str, tuple[Groups, Groups]] = {}
    claims: dict[str, tuple[int, float]] = {}
    for first, second in _neighbours(tracks, segmentation.segments):
        labels = [np.bincount(segmentation.labels[one] + 1).argmax() for one in (first, second)]
        title = "merged" if labels[0] == labels[1] else "kept apart"
        distance = np.linalg.norm(place[first].mean(axis=0) - place[second].mean(axis=0))
        claim = min(len(first), len(second)), -float(distance)
        if title not in found or claim > claims[title]:
            found[title], claims[title] = (first, second), claim
    return [_measured(tracks, title, *found[title]) for title in ("kept apart", "merged") if title in found]


def _neighbours(tracks: Tracks, segments: Groups) -> Iterator[tuple[Groups, Groups]]:
    """Members of every two segments, large enough, that an edge of the Delaunay triangulation joins."""
    place = anchors(tracks)
    numbers, counts = np.unique(segments, return_counts=True)
    large = numbers[(numbers >= 0) & (counts >= _LEAST_POINTS)]
    points = np.flatnonzero(np.isin(segments, large) & np.isfinite(place).all(axis=1))
    ends = np.sort(segments[points[delaunay_edges(place[points])]], axis=1)
    for first, second in np.unique(ends[ends[:, 0] != ends[:, 1]], axis=0):
        yield points[segments[points] == first], points[segments[points] == second]


def _measured(tracks: Tracks, title: str, first: Groups, second: Groups) -> Pair:
    place = anchors(tracks)
    edges = {
        "between": between_edges(place, first, second, _PAIRS),
        "inside first": inside_edges(place, first),
        "inside second": inside_edges(place, second),
    }
    curves = {name: [_summed(change) for change in shear_and_stretch(tracks, e)] for name, e in edges.items()}
    shear = {name: np.degrees(curve[0]) for name, curve in curves.items()}
    return Pair(title, (first, second), shear, {name: curve[1] for name, curve in curves.items()})


def _summed(change: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over edges of changes (F-1, E), summed over frames; an unmeasured frame adds nothing."""
    seen = np.isfinite(change)
    mean = np.where(seen, change, 0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    return np.cumsum(mean)
