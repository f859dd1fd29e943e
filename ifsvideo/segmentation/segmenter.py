"""In-frame shear segmentation: the stages in their order."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from ifsvideo.segmentation.agglomeration import Agglomeration
from ifsvideo.segmentation.assignment import assign, residuals
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues, Group
from ifsvideo.segmentation.epipolar import epipolar_support
from ifsvideo.segmentation.merging import merge_by_shear
from ifsvideo.segmentation.refinement import refine
from ifsvideo.segmentation.sampling import sample_models
from ifsvideo.segmentation.similarity import learnt
from ifsvideo.segmentation.world import static_evidence
from ifsvideo.types import BACKGROUND, UNDECIDED, Segmentation, Tracks

_SPREAD_CELLS = 8
"""The picture is divided into so many cells a side to see how widely a motion is spread."""


@dataclass(frozen=True)
class IFSSegmenter:
    """Segments the tracks of one window; a `ifsvideo.types.Segmenter`.

    Parameters
    ----------
    config : SegmenterConfig
    seed : int
        Same tracks, configuration and seed: same labels.
    """

    config: SegmenterConfig = field(default_factory=SegmenterConfig)
    seed: int = 0

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        """Label every track.

        Parameters
        ----------
        motions : int, optional
            Number of motions, background included, where it is known.

        Raises
        ------
        ValueError
            If ``motions`` is less than 1.
        """
        if motions is not None and motions < 1:
            raise ValueError(f"the number of motions is at least 1, got {motions}")
        usable = np.flatnonzero(tracks.visible.sum(axis=0) >= 2)
        labels = np.full(tracks.points, UNDECIDED, dtype=np.int64)
        background = np.zeros(tracks.points, dtype=bool)
        segments = np.full(tracks.points, -1, dtype=np.int64)
        confidence = np.zeros(tracks.points)
        details: dict[str, Any] = {}
        if len(usable):
            part = self._stages(tracks.select(usable), motions)
            labels[usable], background[usable] = part.labels, part.background
            segments[usable], confidence[usable] = part.segments, part.confidence
            details = dict(part.details, usable=usable)
        return Segmentation(labels, background, segments, confidence, details)

    def _stages(self, tracks: Tracks, motions: int | None) -> Segmentation:
        config, rng = self.config, np.random.default_rng(self.seed)
        size = tracks.size or _extent(tracks)
        unit = float(np.hypot(*size)) / 800
        base = int(
            np.argmax(tracks.visible.sum(axis=1))
        )  # with complete tracks the first frame, as in the thesis
        anchor = np.where(tracks.visible[base, :, None], tracks.xy[base], np.nanmean(tracks.xy, axis=0))

        # 1. What agrees with a static world seen by a moving camera.
        support, evidence, details = self._split(tracks, size, unit, rng)
        background = support >= 0.5
        # 2. and 3. Affine motion models in small disks; every point to one of the nearest that explain it.
        models = sample_models(tracks, background, base, unit, config, rng)
        if len(models):
            residual = residuals(tracks, models, config.centred)
            start = assign(tracks, models, residual, base, config.nearest_models)
            # 4. Segments with clean borders, more of them than motions.
            chosen, solution = refine(tracks, models, residual, start, background, anchor, unit, config)
            fit = residual[chosen, np.arange(tracks.points)] / unit
            details |= {"models": models, "start": start, "solution": solution}
        else:
            chosen, fit = np.zeros(tracks.points, dtype=np.int64), np.zeros(tracks.points)
        segments = np.unique(chosen, return_inverse=True)[1].astype(np.int64)
        # 5. Merge what is one motion.
        if config.merging == "shear":
            groups, scores = merge_by_shear(tracks, segments, anchor, config.pairs, config.shear_ratio, unit)
            labels = _background_first(groups, support, anchor, size)
            confidence = np.ones(tracks.points)
            details["scores"] = scores
        else:
            cues = Cues(tracks, anchor, evidence, unit, config.pairs)
            merging = Agglomeration(cues, learnt())
            labels, confidence = merge_and_label(
                merging, segments, fit < config.outlier_cost, size, config, motions
            )
            details["merges"] = merging.merges
        details |= {"fit": fit, "evidence": evidence, "anchor": anchor, "size": size}
        return Segmentation(labels, background, segments, confidence, details)

    def _split(
        self, tracks: Tracks, size: tuple[int, int], unit: float, rng: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], dict[str, Any]]:
        """Stage 1: support for the background 0..1, evidence of motion, details."""
        if self.config.split == "world":
            evidence, world = static_evidence(tracks, size, self.config.evidence_threshold, rng)
            return 1 / (1 + evidence**2), evidence, {"world": world}
        support = epipolar_support(tracks, self.config.epipolar_error * unit, self.seed)
        # Support of one half, the thesis's own limit, is where evidence turns.
        return support, 2 * (1 - support), {}


def _extent(tracks: Tracks) -> tuple[int, int]:
    """Size of a picture that nobody told: what the points span, from the origin where they are on its
    positive side."""
    low, high = np.nanmin(tracks.xy, axis=(0, 1)), np.nanmax(tracks.xy, axis=(0, 1))
    width, height = np.ceil(high - np.minimum(low, 0)) + 1
    return int(width), int(height)


def _spread(anchor: NDArray[np.float64], size: tuple[int, int]) -> int:
    """Cells of the picture in which points lie."""
    cells = np.floor(anchor / np.array(size) * _SPREAD_CELLS).astype(int)
    return len(np.unique(cells, axis=0))


def _background_first(
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


def merge_and_label(
    merging: Agglomeration,
    segments: NDArray[np.int64],
    explained: NDArray[np.bool_],
    size: tuple[int, int],
    config: SegmenterConfig,
    motions: int | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Stage 5, weighing evidence: from segments to labels.

    Parameters
    ----------
    merging : Agglomeration
        With the measurements and the rule; keeps what it merged.
    segments, explained : (P,)
        As of `Agglomeration.run`.
    size : (width, height) of the picture, pixels

    Returns
    -------
    labels : (P,) int64
    confidence : (P,) float, 0 to 1
    """
    return _label_groups(merging.run(segments, explained, motions), merging, size, config, motions)


def _label_groups(
    groups: list[Group],
    merging: Agglomeration,
    size: tuple[int, int],
    config: SegmenterConfig,
    motions: int | None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Labels and confidence of all points: 0 for the static world, 1, 2, ... for the rest by size."""
    anchor = merging.cues.anchor
    labels = np.full(len(anchor), BACKGROUND, dtype=np.int64)
    claims = [_spread(anchor[g.members], size) / (1 + g.evidence**2) for g in groups]
    still = groups.pop(int(np.argmax(claims)))
    confidence = np.ones(len(anchor))
    number = 0
    for group in sorted(groups, key=lambda g: -len(g.members)):
        apart = merging.apart(group, still)
        count = len(group.members)
        needed = expit(config.least_odds + config.few_points_doubt / count)
        if motions is None and (count < config.least_points or apart < needed):
            confidence[group.members] = 1 - apart
        else:
            number += 1
            labels[group.members] = number
            confidence[group.members] = apart
    return labels, confidence
