"""Settings as data: frozen dataclasses, each default with its reason.

Lengths given as shares are shares of the picture's diagonal, so that one configuration serves every size.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ifsvideo.segmentation.config import SegmenterConfig


@dataclass(frozen=True)
class TrackerConfig:
    """Corners and KLT (section ``[tracking]``)."""

    max_points: int = 1000
    """Points alive at once; about what two cores track as fast as 1280x720 plays."""


@dataclass(frozen=True)
class OverlayConfig:
    """The drawn video (section ``[overlay]``)."""

    legend: bool = True
    """Whether the small legend is drawn."""


@dataclass(frozen=True)
class Config:
    """All settings of a run; the fields are the sections of a TOML file."""

    tracking: TrackerConfig = field(default_factory=TrackerConfig)
    segmentation: SegmenterConfig = field(default_factory=SegmenterConfig)
    overlay: OverlayConfig = field(default_factory=OverlayConfig)
    seed: int = 0
