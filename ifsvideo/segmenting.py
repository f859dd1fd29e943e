"""Tracks from anywhere, told apart as one window."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from ifsvideo.clip import as_tracks
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.types import Segmentation, Tracks


def segment(
    tracks: Tracks | NDArray[Any],
    motions: int | None = None,
    config: SegmenterConfig | None = None,
    seed: int = 0,
) -> Segmentation:
    """Tell apart the motions of tracks from anywhere; all frames are one window.

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
        ``labels`` (P,): 0 background, 1, 2, ... moving, -1 undecided.
    """
    return IFSSegmenter(config or SegmenterConfig(), seed).segment(as_tracks(tracks), motions)
