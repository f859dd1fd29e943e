"""What the groups of stage 5 are: one is the static world, the others move, or are too little to tell."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.special import expit

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Group, Members
from ifsvideo.types import BACKGROUND

_SPREAD_CELLS = 8
"""The picture is divided into so many cells a side to see how widely a motion is spread."""
_FEW = 10
"""Points beyond which doubt falls with the square of their number."""


def merge_and_label(
    merging: Agglomeration,
    window: Window,
    config: SegmenterConfig,
    motions: int | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Stage 5, weighing evidence: from segments to labels, 0 for the static world, 1, 2, ... by size.

    Parameters
    ----------
    merging : Agglomeration
        With the measurements and the rule; keeps what it merged.
    window : Window
    motions : int, optional
        As of `Agglomeration.run`.

    Returns
    -------
    labels : (P,) int64
    confidence : (P,) float, 0 to 1
    """
    segments, size = window.segments, window.size
    groups = merging.run(window, motions)
    cues = merging.cues
    labels = np.full(len(segments), BACKGROUND, dtype=np.int64)
    confidence = np.ones(len(segments))
    still = groups.pop(static_group(groups, cues.anchor, size))
    things: list[Members] = []
    for group in groups:
        parts = [group]
        if motions is None:
            parts = _pieces(merging, group, config.gap * cues.unit)
        believed = []
        for part in parts:
            apart, count = merging.apart(part, still), len(part.members)
            doubt = config.few_points_doubt / count * min(1.0, _FEW / count)
            few = count < config.least_points or apart < expit(doubt)
            if motions is None and few:
                confidence[part.members] = 1 - apart
            else:
                confidence[part.members] = apart
                believed.append(part)
        # What is a thing by itself may yet be one with another part: a lorry and its trailer.
        together = Agglomeration(cues, merging.similarity).merge(believed, stop=config.gap_doubt)
        things += [np.sort(thing.members) for thing in together]
    for number, members in enumerate(sorted(things, key=lambda m: (-len(m), int(m[0]))), 1):
        labels[members] = number
    return labels, confidence


def apart_from_each_other(
    labels: NDArray[np.int64], window: Window, merging: Agglomeration
) -> NDArray[np.float64]:
    """How likely each two of the labels are two motions (G, G), 1 where one has no points.

    Parameters
    ----------
    labels : (P,) int64
        From 0, as they are in the end: parts were rejoined or contested after they were merged.
    window : Window
    merging : Agglomeration
        With the measurements and the rule.
    """
    count = int(labels.max(initial=-1)) + 1
    apart = np.ones((count, count))
    groups = {}
    for label in np.unique(labels).tolist():
        members = np.flatnonzero(labels == label)
        reliable = members[window.explained[members]]
        groups[label] = merging.cues.group(members, reliable if len(reliable) >= 2 else members)
    for a, b in combinations(groups, 2):
        apart[a, b] = apart[b, a] = merging.apart(groups[a], groups[b])
    return apart


def static_group(groups: list[Group], anchor: NDArray[np.float64], size: tuple[int, int]) -> int:
    """Which group is the static world: it fits, and is spread over the picture."""
    claims = [_spread(anchor[g.members], size) / (1 + g.evidence**2) for g in groups]
    return int(np.argmax(claims))


def _pieces(merging: Agglomeration, group: Group, gap: float) -> list[Group]:
    """Parts of a group that lie farther than ``gap`` from each other."""
    members, cues = group.members, merging.cues
    if len(members) < 2:
        return [group]
    piece = fcluster(linkage(cues.anchor[members], "single"), gap, "distance")
    if piece.max() == 1:
        return [group]
    parts = [np.sort(members[piece == number]) for number in np.unique(piece)]
    reliable = [part[np.isin(part, group.reliable)] for part in parts]
    return [
        cues.group(part, own if len(own) >= 2 else part) for part, own in zip(parts, reliable, strict=True)
    ]


def _spread(anchor: NDArray[np.float64], size: tuple[int, int]) -> int:
    """Cells of the picture in which points lie."""
    cells = np.floor(anchor / np.array(size) * _SPREAD_CELLS).astype(int)
    return len(set(zip(*cells.T.tolist(), strict=True)))


def background_first(
    groups: NDArray[np.int64],
    support: NDArray[np.float64],
    anchor: NDArray[np.float64],
    size: tuple[int, int],
) -> NDArray[np.int64]:
    """Number groups so that 0 is the background: most epipolar support and widest spread; the rest by
    size."""
    count = int(groups.max()) + 1
    members = [groups == g for g in range(count)]
    claim = [support[m].mean() * _spread(anchor[m], size) for m in members]
    order = sorted(range(count), key=lambda g: -int(members[g].sum()))
    order.sort(key=lambda g: g != int(np.argmax(claim)))
    return np.argsort(order)[groups].astype(np.int64)
