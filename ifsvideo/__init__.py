"""ifsvideo tells what moves by itself in a video whose camera moves too.

A video: ``Pipeline().run("clip.mp4", output="out.mp4", labels="out.csv")``.
Tracks from anywhere: ``segment(tracks)``.
"""

import os
from typing import Any

# The matrices are small: several BLAS threads wait for each other longer than they work. No effect where
# numpy was imported before, or the user decided.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from numpy.typing import NDArray

from ifsvideo.clip import as_tracks
from ifsvideo.config import Config, ObjectsConfig, OverlayConfig, TrackerConfig
from ifsvideo.config_file import load_config
from ifsvideo.errors import IfsVideoError, InputError, OutputError, UsageError
from ifsvideo.objects.history import Event, ObjectTable
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.products import Products
from ifsvideo.pipeline import Pipeline
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.tracking.files import load_tracks
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.types import (
    FramePoints,
    LabelTable,
    MovingObject,
    Renderer,
    Result,
    Scene,
    Segmentation,
    Segmenter,
    Tracker,
    Tracks,
    VideoInfo,
)

__version__ = "0.1.0"

__all__ = [
    "Config",
    "Event",
    "FramePoints",
    "IFSSegmenter",
    "IfsVideoError",
    "InputError",
    "KltTracker",
    "LabelTable",
    "MovingObject",
    "ObjectTable",
    "ObjectsConfig",
    "OutputError",
    "OverlayConfig",
    "OverlayRenderer",
    "Pipeline",
    "Products",
    "Renderer",
    "Result",
    "Scene",
    "Segmentation",
    "Segmenter",
    "SegmenterConfig",
    "Tracker",
    "TrackerConfig",
    "Tracks",
    "UsageError",
    "VideoInfo",
    "__version__",
    "load_config",
    "load_tracks",
    "segment",
]


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
