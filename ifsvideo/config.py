"""Settings as data: frozen dataclasses, each default with its reason.

Lengths given as shares are shares of the picture's diagonal, so that one configuration serves every size.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ifsvideo.errors import UsageError
from ifsvideo.segmentation.config import SegmenterConfig


@dataclass(frozen=True)
class TrackerConfig:
    """Corners and KLT (section ``[tracking]``)."""

    max_points: int = 1000
    """Points alive at once; about what two cores track as fast as 1280x720 plays."""
    scale: float = 1.0
    """Share of the picture's size in which it is tracked, up to 1: half of it takes a quarter of the time,
    and small things are lost. The overlay keeps the picture's size."""
    cells: int = 96
    """Cells of the grid that spreads the corners (12 x 8 on a 3:2 picture); a cell is about as large as the
    smallest object that is to be told apart."""
    crowding: float = 2.0
    """Most points of a cell, in fair shares (max_points / cells): more and a textured corner takes all the
    points, fewer and the sky's share goes unused."""
    min_distance: float = 0.008
    """Least distance of a new corner to its neighbours, share of the diagonal: 6 px at 640x360. Half the
    spacing of 1000 points spread evenly, so that small objects still get several."""
    quality: float = 0.02
    """Least corner strength (smaller eigenvalue), share of the strongest of the cell. OpenCV's examples take
    0.01 of the whole picture's; a cell has less range."""
    min_contrast: float = 2.0
    """Least strength of any corner: RMS grey levels per pixel across the weaker direction. Noise with a
    standard deviation of 4 grey levels stays below it after Sobel's smoothing (factor sqrt(12) / 8)."""
    birth_interval: int = 3
    """Most frames between two searches for new corners: what moves fast is lost within a few."""
    birth_interval_s: float = 0.1
    """Most seconds between them: at 10 frames a second every frame is searched. There a car that passes
    loses a third of its points from one frame to the next, and would be bare for two more."""
    window: int = 11
    """Height of the KLT window, pixels, odd; its width is the nearest multiple of 8. OpenCV's 21 drags
    background along within 10 px of a moving edge; it can be compared by this setting and
    ``python -m ifsvideo.benchmark samples --config``."""
    max_return_error: float = 0.001
    """Greatest distance between a point and itself tracked forward and back, share of the diagonal: 0.7 px at
    640x360 (Kalal et al., Forward-Backward Error, ICPR 2010)."""
    max_step: float = 0.15
    """Longest step between two frames, share of the diagonal; further, KLT's pyramid finds by chance only."""
    min_similarity: float = 0.6
    """Least correlation of the patch with that of the frame before; other surfaces' is 0 +- 0.3."""
    check_interval: int = 8
    """Frames between two comparisons of a track with the patch of its birth; KLT slides by tenths of a pixel
    a frame, and to check every track in every frame would cost as much as KLT itself."""
    min_resemblance: float = 0.85
    """Least correlation with the patch of its birth, after an affine alignment; else the track has slid off,
    or rides along an object's outline over changing ground. Leaves and branches, whose parts move against
    each other, stay at 0.6 to 0.8 for a second."""
    max_drift: float = 0.004
    """Farthest that this alignment may move a point, share of the diagonal: 3 px at 640x360."""
    margin: float = 0.01
    """Distance from the picture's edge at which a track ends, share of the diagonal: the window looks out."""

    def __post_init__(self) -> None:
        if not 1 <= self.max_points <= 30000:
            raise UsageError(f"tracking.max_points must be 1 to 30000, got {self.max_points}")
        if not 0 < self.scale <= 1:
            raise UsageError(f"tracking.scale must be above 0 and at most 1, got {self.scale}")
        if self.window < 5 or self.window % 2 == 0:
            raise UsageError(f"tracking.window must be odd and at least 5, got {self.window}")
        for name in ("cells", "birth_interval", "check_interval"):
            if getattr(self, name) < 1:
                raise UsageError(f"tracking.{name} must be at least 1, got {getattr(self, name)}")
        for name in (
            "crowding",
            "min_distance",
            "min_contrast",
            "birth_interval_s",
            "max_return_error",
            "max_step",
            "max_drift",
        ):
            if not getattr(self, name) > 0:
                raise UsageError(f"tracking.{name} must be positive, got {getattr(self, name)}")
        for name in ("quality", "min_similarity", "min_resemblance", "margin"):
            if not 0 <= getattr(self, name) < 1:
                raise UsageError(f"tracking.{name} must be at least 0 and below 1, got {getattr(self, name)}")


@dataclass(frozen=True)
class OverlayConfig:
    """The drawn video (section ``[overlay]``); what is None is as in `ifsvideo.output.styles`."""

    style: Literal["full", "dots", "trails", "hulls", "spotlight"] = "full"
    """``full`` shows all that is known; the others are for showing to people: points, paths, areas, or what
    moves in colour on a picture that is grey."""
    layout: Literal["overlay", "side-by-side", "stacked", "before-after"] = "overlay"
    """The drawn picture alone; beside or below the plain one; or parted by a line that sweeps to and fro."""
    transparent: bool = False
    """Whether the drawing alone is written, to be laid over something else: .mov, .webp or .gif."""
    title: str = ""
    """Words at the lower left, none unless told."""
    title_s: float = 4.0
    """How long they stand there, seconds of the output: long enough to read a line twice; 0: to the end."""
    slow: float = 1.0
    """How many times slower the output plays; its sound is left out then, which would not fit."""
    max_size_mb: float | None = None
    """Largest .gif or .webp, 10^6 bytes, kept by showing less (`ifsvideo.video.animation`); None: any."""
    legend: bool = True
    """Whether the small legend is drawn."""
    trail_s: float | None = None
    """Length of the trails, seconds."""
    hull_opacity: float | None = None
    """How strongly an object's colour covers it, 0 to 1; more and the object itself is hard to see."""
    picture_brightness: float | None = None
    """Brightness of the picture behind the drawing, 0 to 1."""
    picture_colour: float | None = None
    """Share of the picture's own colour that is kept, 0 to 1."""

    def __post_init__(self) -> None:
        for name, least, most in (
            ("trail_s", 0.0, 10.0),
            ("hull_opacity", 0.0, 1.0),
            ("picture_brightness", 0.0, 1.0),
            ("picture_colour", 0.0, 1.0),
            ("title_s", 0.0, 3600.0),
            ("slow", 1.0, 100.0),
            ("max_size_mb", 0.01, 10000.0),
        ):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise UsageError(f"overlay.{name} must be {least:g} to {most:g}, got {value}")
        if self.transparent and self.layout != "overlay":
            raise UsageError(
                f"transparent leaves the picture out, {self.layout} shows it; ask for one of them"
            )


@dataclass(frozen=True)
class ObjectsConfig:
    """Windows over a clip, and objects that keep their number (section ``[objects]``).

    Lengths are pixels of a 640x480 picture and are scaled with the diagonal of the one at hand.
    """

    window_s: float = 1.0
    """Length of a window, seconds: long enough for a car to move against its surroundings, short enough for
    half the tracks to last."""
    window_frames: int = 30
    """Most frames of a window; more cost time and tell little."""
    least_frames: int = 12
    """Fewest frames of a window where the rate is low: at 5 a second a window is longer than a second."""
    least_life: float = 0.5
    """Share of a window that a track must last to be segmented; shorter ones follow their neighbours."""
    least_shared: int = 3
    """Tracks that two windows' labels must share to be one object."""
    least_windows: int = 2
    """Windows that must find an object, where the clip has so many: parallax and slipping corners that look
    like motion in one window seldom do so again in the next, which sees half of the same frames."""
    least_confidence: float = 0.99
    """How sure of an object the surest ``least_windows`` windows must be together, by the mean of their log
    odds. In handheld_no_movers.mp4 and the rendered static drive (``python -m ifsvideo.benchmark static``)
    parallax at the picture's border and what windows mirror stay below in most runs; at 0.98 they do not. A
    car or a person is 0.999 as soon as it moves for a second, a van of a dozen points far ahead 0.99."""
    alone_confidence: float = 0.9999
    """How sure a window must be if no other finds the object, or none that is sure of it."""
    least_seconds: float = 0.5
    """What lives shorter is no object; its points go to the background."""
    longest_loss_s: float = 1.0
    """How long an object may be lost, behind a pole or a wiper, and still be the same, seconds: longer, and
    another may have come in its place."""
    longest_freeze_s: float = 1.0
    """How long repeated frames are taken for no frames, seconds; what the camera did not send, or the change
    of a rate put in, is shorter."""
    check_borders: bool = True
    """Whether tracks that move with an object are asked if they lie on it or on the ground beside it
    (`ifsvideo.objects.figure_ground`)."""
    fixed_spread: float = 0.9
    """Radius within which a point fixed to the camera stays, pixels: KLT's jitter on a weak reflection."""
    fixed_shake: float = 3.0
    """How far the world's common motion must have gone meanwhile, pixels."""
    fixed_travel: float = 10.0
    """How far the typical point of the world must have gone meanwhile, pixels, summed over frames."""
    fixed_memory_s: float = 8.0
    """How much of the past is looked at, seconds: on a smooth road it takes seconds until the camera has
    shaken enough. Longer costs memory and tells no more of most tracks."""
    fixed_world_share: float = 0.3
    """Share of the picture's textured cells in which points must move; below it the camera stands still."""

    def __post_init__(self) -> None:
        for name in (
            "window_s",
            "window_frames",
            "least_frames",
            "least_shared",
            "fixed_spread",
            "fixed_shake",
            "fixed_memory_s",
        ):
            if not getattr(self, name) > 0:
                raise UsageError(f"objects.{name} must be positive, got {getattr(self, name)}")
        for name in ("least_life", "least_confidence", "alone_confidence", "fixed_world_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise UsageError(f"objects.{name} must be 0 to 1, got {getattr(self, name)}")
        for name in (
            "least_seconds",
            "fixed_travel",
            "longest_loss_s",
            "longest_freeze_s",
        ):
            if not getattr(self, name) >= 0:
                raise UsageError(f"objects.{name} must not be negative, got {getattr(self, name)}")


@dataclass(frozen=True)
class Config:
    """All settings of a run; the fields are the sections of a TOML file."""

    tracking: TrackerConfig = field(default_factory=TrackerConfig)
    segmentation: SegmenterConfig = field(default_factory=SegmenterConfig)
    objects: ObjectsConfig = field(default_factory=ObjectsConfig)
    overlay: OverlayConfig = field(default_factory=OverlayConfig)
    seed: int = 0
