"""In-frame shear segmentation: the stages in their order."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.lens import undistort
from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.assignment import assign, residuals
from ifsvideo.segmentation.background import apart_from_each_other, background_first, merge_and_label
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.contest import contested
from ifsvideo.segmentation.cues import Cues
from ifsvideo.segmentation.epipolar import epipolar_support
from ifsvideo.segmentation.merging import merge_by_shear
from ifsvideo.segmentation.refinement import data_term, delaunay_edges, refine
from ifsvideo.segmentation.sampling import sample_models
from ifsvideo.segmentation.selection import needed_models
from ifsvideo.segmentation.similarity import learnt
from ifsvideo.segmentation.smoothing import filled, noisy, smoothed
from ifsvideo.segmentation.static_core import in_static_core
from ifsvideo.segmentation.voting import voted
from ifsvideo.segmentation.whole import Whole
from ifsvideo.segmentation.world import World, fit_world
from ifsvideo.types import UNDECIDED, Segmentation, Tracks


@dataclass(frozen=True)
class _Prepared:
    """What no chance decides, and is the same however often a window is segmented.

    Attributes
    ----------
    measured : Tracks
        Without the lens's bend and the short gaps.
    tracks : Tracks
        Without their noise, too.
    size : (width, height) of the picture, pixels
    unit : float, pixels of the picture per pixel of a 640x480 one
    base : int, frame in which disks lie
    anchor : (P, 2) float, places in the base frame, the mean ones of points not seen there
    graph : (E, 2) int, neighbours
    """

    measured: Tracks
    tracks: Tracks
    size: tuple[int, int]
    unit: float
    base: int
    anchor: NDArray[np.float64]
    graph: NDArray[np.int64]


@dataclass(frozen=True)
class IFSSegmenter:
    """Segments the tracks of one window; a `ifsvideo.types.Segmenter`.

    Parameters
    ----------
    config : SegmenterConfig
    seed : int
        Same tracks, configuration and seed: same labels.
    alone : bool
        Whether these tracks are all there is, not a window of a clip that others overlap. Then a cut of all
        points at once is asked, too, and what it does not confirm is segmented several times
        (`ifsvideo.segmentation.voting`), the static core grows twice (`ifsvideo.segmentation.static_core`),
        and movers contest the ground (`ifsvideo.segmentation.contest`).
    """

    config: SegmenterConfig = field(default_factory=SegmenterConfig)
    seed: int = 0
    alone: bool = False

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
            rng, prepared = np.random.default_rng(self.seed), self._prepared(tracks.select(usable))

            def stages() -> Segmentation:
                return self._stages(prepared, motions, rng)

            whole = Whole(prepared.measured, noisy(prepared.measured, prepared.unit)) if self.alone else None
            part = stages() if whole is None else voted(stages, self.config.votes, whole, motions)
            labels[usable], background[usable] = part.labels, part.background
            segments[usable], confidence[usable] = part.segments, part.confidence
            details = dict(part.details, usable=usable)
        return Segmentation(labels, background, segments, confidence, details)

    def _prepared(self, tracks: Tracks) -> _Prepared:
        config = self.config
        tracks, size = in_a_picture(tracks)
        if config.distortion:
            tracks = replace(tracks, xy=undistort(tracks.xy, size, config.distortion))
        unit = float(np.hypot(*size)) / 800
        measured = filled(tracks)
        tracks = smoothed(measured, config.smoothing, unit)
        # With complete tracks the first frame, as in the thesis.
        base = int(np.argmax(tracks.visible.sum(axis=1)))
        anchor = np.where(tracks.visible[base, :, None], tracks.xy[base], np.nanmean(tracks.xy, axis=0))
        return _Prepared(measured, tracks, size, unit, base, anchor, delaunay_edges(anchor))

    def _stages(self, prepared: _Prepared, motions: int | None, rng: np.random.Generator) -> Segmentation:
        config, tracks, size, unit = self.config, prepared.tracks, prepared.size, prepared.unit
        anchor, base = prepared.anchor, prepared.base

        # 1. What agrees with a static world seen by a moving camera.
        support, evidence, world = self._split(tracks, size, unit, rng)
        background = support >= 0.5
        # 2. and 3. Affine motion models in small disks, those that are needed; every point to one of them.
        models = sample_models(tracks, background, base, unit, config, rng)
        if len(models):
            residual = residuals(tracks, models, config.centred)
            cost = data_term(residual, models, 1 - support, unit, config)
            if config.label_cost > 0:
                kept = needed_models(cost, config.label_cost)
                models, residual, cost = models.select(kept), residual[kept], cost[:, kept]
                start = cost.argmin(axis=1)
            else:
                start = assign(tracks, models, residual, base, config.nearest_models)
            # 4. Segments with clean borders, more of them than motions.
            chosen, solution = refine(tracks, models, cost, start, prepared.graph, unit, config)
            fit = residual[chosen, np.arange(tracks.points)] / unit
            details = {"models": models, "start": start, "solution": solution}
        else:
            chosen, fit = np.zeros(tracks.points, dtype=np.int64), np.zeros(tracks.points)
            details = {}
        segments = np.unique(chosen, return_inverse=True)[1].astype(np.int64)
        # 5. Merge what is one motion: cautiously, then in the world of what is surely static.
        if config.merging == "shear":
            groups, scores = merge_by_shear(tracks, segments, anchor, config.pairs, config.shear_ratio, unit)
            labels = background_first(groups, support, anchor, size)
            confidence = np.ones(tracks.points)
            details["scores"] = scores
        else:
            nearness = np.zeros(tracks.points) if world is None else world.nearness
            first = Cues(tracks, anchor, evidence, nearness, unit, config.pairs)
            window = Window(segments, fit < config.outlier_cost, size)
            doubts = config.core_doubts(self.alone)
            cues, joined = in_static_core(first, window, world, learnt(), doubts, config.evidence_threshold)
            merging = Agglomeration(cues, learnt().final)
            labels, confidence = merge_and_label(merging, joined, config, motions)
            if self.alone and config.contest and world is not None:
                # 6. What a mover predicts better than the static world does is its own.
                reach = config.gap * unit
                labels, confidence = contested(labels, confidence, window, world, cues, reach)
            evidence = cues.evidence
            if self.alone:
                apart = apart_from_each_other(labels, window, merging)
                details |= {"doubt": merging.doubt, "apart": apart, "world": world}
            details |= {"window": window, "joined": joined, "cues": cues, "merges": merging.merges}
        details |= {"fit": fit, "evidence": evidence, "anchor": anchor, "size": size}
        return Segmentation(labels, background, segments, confidence, details)

    def _split(
        self, tracks: Tracks, size: tuple[int, int], unit: float, rng: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], World | None]:
        """Stage 1: support for the background 0..1, evidence of motion, the world where one is fitted."""
        if self.config.split == "world":
            world, threshold = fit_world(tracks, size, rng), self.config.evidence_threshold
            evidence = np.zeros(tracks.points) if world is None else world.evidence(threshold)
            return 1 / (1 + evidence**2), evidence, world
        support = epipolar_support(tracks, self.config.epipolar_error * unit, self.seed)
        # Support of one half, the thesis's own limit, is where evidence turns.
        return support, 2 * (1 - support), None


def in_a_picture(tracks: Tracks) -> tuple[Tracks, tuple[int, int]]:
    """The tracks and the size of their picture; where nobody told it, what the points span.

    It reaches to the origin where all points lie on its positive side; coordinates from the picture's middle
    are moved there, so that the optical centre is where the camera's was.
    """
    if tracks.size:
        return tracks, tracks.size
    low, high = np.nanmin(tracks.xy, axis=(0, 1)), np.nanmax(tracks.xy, axis=(0, 1))
    origin = np.minimum(low, 0)
    width, height = np.ceil(high - origin).astype(int) + 1
    return replace(tracks, xy=tracks.xy - origin), (int(width), int(height))
