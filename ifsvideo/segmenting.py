"""Tracks from anywhere, told apart: as one window where they last, else window by window."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.clip import as_tracks
from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.labelling import label_frames
from ifsvideo.objects.windows import WindowLabeller, WindowLabels
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter, in_a_picture
from ifsvideo.tracking.steps import steps_of
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import BACKGROUND, UNDECIDED, Segmentation, Tracks

_LIVES = 1.25
"""Length of a window, in typical lives of a track: most tracks that begin in it are then seen in half of it,
and are segmented; the others follow these."""
_SHORTEST = 15
"""Frames of a window at least, where there are so many: in fewer hardly anything has moved."""
_OBJECTS = ObjectsConfig(
    least_windows=1, least_confidence=0.0, alone_confidence=0.0, least_seconds=0.0, fixed_world_share=1.0
)
"""As of a clip, but what one window finds counts: few there may be, and no more frames to wait for. Tracks
that someone chose to give are none of a bonnet."""


def segment(
    tracks: Tracks | NDArray[Any],
    motions: int | None = None,
    config: SegmenterConfig | None = None,
    seed: int = 0,
) -> Segmentation:
    """Tell apart the motions of tracks from anywhere.

    Parameters
    ----------
    tracks : Tracks, or (F, P, 2) array
        Pixels; NaN (or a masked array's mask) where a point is not seen.
    motions : int, optional
        Number of motions, the background's included, where it is known.
    config : SegmenterConfig, optional
    seed : int, optional
        The same tracks and seed give the same labels.

    Returns
    -------
    Segmentation
        ``labels`` (P,): 0 background, 1, 2, ... moving, by size, -1 undecided.
    """
    return TracksSegmenter(config or SegmenterConfig(), seed).segment(as_tracks(tracks), motions)


@dataclass(frozen=True)
class TracksSegmenter:
    """Segments all tracks of a sequence, however long it is and however short they are; a `Segmenter`.

    Where the typical track is seen in most frames (`SegmenterConfig.lasting`), or the number of motions is
    known, all frames are one window. Else the sequence is cut into windows about as long as tracks live, each
    half over the next, and these are joined as those of a clip: by the tracks that they share. A camera that
    has passed most of what it saw at first is no single view, and what is seen too shortly to tell a window's
    motion follows its neighbours.

    One window is segmented several times where that is doubtful, and movers contest its ground
    (`SegmenterConfig.votes`, `SegmenterConfig.contest`).

    Parameters
    ----------
    config : SegmenterConfig
    seed : int
    """

    config: SegmenterConfig = field(default_factory=SegmenterConfig)
    seed: int = 0

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        """See `ifsvideo.types.Segmenter`.

        Of tracks that were segmented in windows there is no over-segmentation, nor any details: ``segments``
        are -1. The confidence of a track is the mean over its windows.
        """
        segmenter = IFSSegmenter(self.config, self.seed)
        length = None if motions is not None else window_length(tracks, self.config.lasting)
        if length is not None:
            return _by_windows(segmenter, tracks, length)
        return replace(segmenter, alone=True).segment(tracks, motions)


def window_length(tracks: Tracks, lasting: float) -> int | None:
    """Frames of the windows into which tracks are cut; None where they are one window.

    Parameters
    ----------
    lasting : float
        As of `SegmenterConfig`.
    """
    lives = tracks.visible.sum(axis=0)
    lives = lives[lives >= 2]
    typical = float(np.median(lives)) if len(lives) else np.inf
    if typical >= lasting * tracks.frames:
        return None
    return min(max(_SHORTEST, round(_LIVES * typical)), tracks.frames)


@dataclass(frozen=True)
class _Labelled:
    """A window's labels, made at once."""

    labels: WindowLabels

    def done(self) -> bool:
        return True

    def value(self) -> WindowLabels:
        return self.labels


def _by_windows(segmenter: IFSSegmenter, tracks: Tracks, length: int) -> Segmentation:
    """The tracks as a clip of windows of so many frames; each track is what it is in most of its frames."""
    tracks, size = in_a_picture(tracks)
    tracks = replace(tracks, ids=np.arange(tracks.points), size=size)
    config = replace(_OBJECTS, window_frames=length)
    labeller = WindowLabeller(segmenter, config)
    said: dict[int, list[float]] = defaultdict(list)

    def label(window: Tracks) -> _Labelled:
        labels = labeller(window)
        for track, sure in zip(window.ids.tolist(), labels.confidence.tolist(), strict=True):
            said[track].append(sure)
        return _Labelled(labels)

    frames = list(label_frames(steps_of(Trajectories.from_tracks(tracks)), label, config, size))
    labels = _most_often(
        np.concatenate([frame.points.ids for frame in frames]),
        np.concatenate([frame.labels for frame in frames]),
        tracks.points,
    )
    confidence = np.array([np.mean(said.get(track, [0.0])) for track in range(tracks.points)])
    return Segmentation(labels, labels == BACKGROUND, np.full(tracks.points, -1, np.int64), confidence)


def _most_often(track: NDArray[np.int64], label: NDArray[np.int64], tracks: int) -> NDArray[np.int64]:
    """The label that most observations of each track have, the moving ones anew from 1, by size; -1 of one
    without observations."""
    pairs, count = np.unique(np.column_stack([track, label]), axis=0, return_counts=True)
    labels = np.full(tracks, UNDECIDED, dtype=np.int64)
    order = np.argsort(count, kind="stable")  # what stands last is what is kept
    labels[pairs[order, 0]] = pairs[order, 1]
    numbers, sizes = np.unique(labels[labels > BACKGROUND], return_counts=True)
    result = labels.copy()
    for number, old in enumerate(numbers[np.argsort(-sizes, kind="stable")].tolist(), 1):
        result[labels == old] = number
    return result
