"""ifsvideo tells what moves by itself in a video whose camera moves too.

A video: ``Pipeline().run("clip.mp4", output="out.mp4", labels="out.csv")``.
Tracks from anywhere: ``segment(tracks)``.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

# The matrices are small: several BLAS threads wait for each other longer than they work. No effect where
# numpy was imported before, or the user decided.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

if TYPE_CHECKING:
    from ifsvideo.config import Config, ObjectsConfig, OverlayConfig, TrackerConfig
    from ifsvideo.config_file import load_config
    from ifsvideo.errors import IfsVideoError, InputError, OutputError, UsageError
    from ifsvideo.objects.history import Event, ObjectTable
    from ifsvideo.output.overlay import OverlayRenderer
    from ifsvideo.output.products import Products
    from ifsvideo.pipeline import Pipeline
    from ifsvideo.segmentation.config import SegmenterConfig
    from ifsvideo.segmentation.segmenter import IFSSegmenter
    from ifsvideo.segmenting import segment
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

_HOMES = {
    "config": ("Config", "ObjectsConfig", "OverlayConfig", "TrackerConfig"),
    "config_file": ("load_config",),
    "errors": ("IfsVideoError", "InputError", "OutputError", "UsageError"),
    "objects.history": ("Event", "ObjectTable"),
    "output.overlay": ("OverlayRenderer",),
    "output.products": ("Products",),
    "pipeline": ("Pipeline",),
    "segmentation.config": ("SegmenterConfig",),
    "segmentation.segmenter": ("IFSSegmenter",),
    "segmenting": ("segment",),
    "tracking.files": ("load_tracks",),
    "tracking.tracker": ("KltTracker",),
}
"""Modules of the names above; of those not told here, `ifsvideo.types`."""


def __getattr__(name: str) -> Any:
    """Import a name when it is asked for.

    OpenCV and SciPy take half a second to load, in which Ctrl-C would raise before the command can catch it.
    """
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((module for module, names in _HOMES.items() if name in names), "types")
    globals()[name] = value = getattr(import_module(f"{__name__}.{home}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
