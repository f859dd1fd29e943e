"""From the trajectories of a clip to a label for every observation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.camera_fixed import camera_fixed_tracks
from ifsvideo.objects.linking import Linker
from ifsvideo.objects.numbering import settle
from ifsvideo.objects.windows import follow_neighbours, window_bounds
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import BACKGROUND, UNDECIDED, Segmenter


def label_clip(
    trajectories: Trajectories,
    segmenter: Segmenter,
    config: ObjectsConfig,
    motions: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.int32]:
    """Label of every row of the trajectories.

    Windows are segmented one after another and their labels linked. Whether an observation moves is what the
    window says whose centre is nearest in time; with which object, what most windows say of its track.
    """
    bounds = window_bounds(trajectories.frames, trajectories.fps, config)
    fixed = camera_fixed_tracks(trajectories, config)
    linker = Linker(config.least_shared, config.least_windows)
    seen_in: Counter[int] = Counter()
    labels = np.full(len(trajectories.ids), UNDECIDED, dtype=np.int32)
    unit = float(np.hypot(*trajectories.size)) / 800 if trajectories.size else 1.0
    halves = [(a[1] + b[0]) // 2 for a, b in pairwise(bounds)]
    edges = [0, *halves, trajectories.frames]
    for k, (start, stop) in enumerate(bounds):
        tracks = trajectories.window(start, stop)
        tracks = tracks.select(~np.isin(tracks.ids, fixed))
        found = np.full(tracks.points, UNDECIDED, dtype=np.int64)
        lasting = np.flatnonzero(tracks.visible.sum(axis=0) >= max(2, config.least_life * (stop - start)))
        if len(lasting):
            segmentation = segmenter.segment(tracks.select(lasting), motions)
            found = follow_neighbours(tracks, lasting, segmentation.labels, unit)
        found = linker.link(tracks.ids, found, np.nanmean(tracks.xy, axis=0))
        seen_in.update(int(number) for number in np.unique(found[found > BACKGROUND]))
        first, last = np.searchsorted(trajectories.frame, [edges[k], edges[k + 1]])
        ids = trajectories.ids[first:last]
        known = np.isin(ids, tracks.ids)
        labels[first:last][known] = found[np.searchsorted(tracks.ids, ids[known])]
        if progress:
            progress(k + 1, len(bounds))
    confirmed = [n for n, windows in seen_in.items() if windows >= min(config.least_windows, len(bounds))]
    moving = labels > BACKGROUND
    labels[moving] = [linker.number_of(int(i)) or BACKGROUND for i in trajectories.ids[moving]]
    labels[moving & ~np.isin(labels, confirmed)] = BACKGROUND
    return settle(trajectories, labels, config)
