"""Settings of the segmenter."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmenterConfig:
    """In-frame shear segmentation (section ``[segmentation]``)."""
