"""Tracks made worse on purpose: how much noise and how many gaps a segmenter bears."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ifsvideo.types import Tracks


@dataclass(frozen=True)
class Perturbation:
    """What is done to the tracks before a segmenter sees them.

    Attributes
    ----------
    noise : float
        Standard deviation of the Gaussian noise added to x and to y of every observation, pixels.
    drop : float
        Share of the observations deleted, 0 to below 1, drawn evenly from all points and frames.
    """

    noise: float = 0.0
    drop: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.noise < float("inf"):
            raise ValueError(f"noise must be a finite number of pixels, at least 0, got {self.noise}")
        if not 0 <= self.drop < 1:
            raise ValueError(f"drop must be at least 0 and below 1, got {self.drop}")

    def apply(self, tracks: Tracks, seed: int) -> Tracks:
        """Return the spoilt tracks; the very same where nothing is to be done.

        One seed draws the same directions for every strength of the noise and the same order for every share
        dropped, so that figures along a curve differ by the strength alone.
        """
        if self.noise:
            rng = np.random.default_rng([seed, 1])
            tracks = replace(tracks, xy=tracks.xy + self.noise * rng.standard_normal(tracks.xy.shape))
        if self.drop:
            seen = np.flatnonzero(tracks.visible)
            order = np.random.default_rng([seed, 2]).permutation(seen)
            visible = tracks.visible.copy()
            visible.flat[order[: round(self.drop * len(seen))]] = False
            tracks = replace(tracks, visible=visible, xy=np.where(visible[..., None], tracks.xy, np.nan))
        return tracks


UNCHANGED = Perturbation()
"""Nothing is done."""
