"""Sequences from which stage 5's rule is learnt: where they come from, and which of them belong together."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ifsvideo.benchmark import datasets, samples
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.runner import in_processes
from ifsvideo.config import Config
from ifsvideo.errors import InputError
from ifsvideo.objects.windows import window_bounds
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import LabelTable
from ifsvideo.video import open_source

SOURCE_WEIGHTS = {"hopkins155": 1.0, "kt3dmoseg": 4.0, "samples": 4.0, "simulated": 0.3}
"""What a sequence of each source counts. KT3DMoSeg and the sample clips are few, but show what the package is
for, driving and static scenes full of parallax; the 155 of Hopkins mostly show checkerboards. Of simulated
windows one can ask for any number; that of 150 counts a third of Hopkins-155."""


@dataclass(frozen=True)
class Example:
    """A labelled sequence to learn from.

    Attributes
    ----------
    source : str
        A key of `SOURCE_WEIGHTS`.
    group : str
        Sequences that show the same frames have the same group; none is judged by weights that were learnt
        from another of its group.
    """

    source: str
    group: str
    sequence: LabelledSequence


@dataclass(frozen=True)
class _Clip:
    """A sample clip, to be tracked once."""

    name: str
    video: Path
    truth: Path
    config: Config

    def __str__(self) -> str:
        return self.name


def of_points(dataset: str, folder: Path, only: str = "*") -> list[Example]:
    """Sequences of a point data set, as `ifsvideo.benchmark.datasets.load` reads them."""
    sequences = datasets.load(dataset, folder, only)
    # NAME_g12, NAME_g13, NAME_g23: the points of two of NAME's three motions.
    return [Example(dataset, f"{dataset} {re.sub(r'_g[0-9]{2}$', '', s.name)}", s) for s in sequences]


def of_samples(
    folder: Path, config: Config, only: str = "*", jobs: int = 1, quiet: bool = False
) -> list[Example]:
    """Windows of the sample clips, tracked and divided as `ifsvideo.pipeline.Pipeline` does.

    A track's motion is what the masks show under most of its rows in that window.
    """
    clips = [_Clip(name, *files, config) for name, files in samples.clips(folder, only).items()]
    found = in_processes(_windows_of_clip, clips, jobs, quiet, "samples")
    return [
        Example("samples", f"samples {clip.name}", window)
        for clip, windows in zip(clips, found, strict=True)
        for window in windows
    ]


def of_simulation(
    simulate: Callable[[int], LabelledSequence], count: int, seed: int, jobs: int = 1, quiet: bool = False
) -> list[Example]:
    """``count`` simulated windows, of the seeds ``seed``, ``seed + 1``, ..."""
    seeds = range(seed, seed + count)
    made = in_processes(simulate, seeds, jobs, quiet, "simulation")
    return [Example("simulated", f"simulated {s}", one) for s, one in zip(seeds, made, strict=True)]


def _windows_of_clip(clip: _Clip) -> list[LabelledSequence]:
    """Track a clip; its windows, with the tracks that last long enough to be segmented."""
    masks, config = samples.load_masks(clip.truth), clip.config.objects
    source = open_source(clip.video)
    info = source.info
    with closing(source.frames()) as frames:
        points = KltTracker(clip.config.tracking, float(info.fps)).track(frames)
        found = Trajectories.collect(points, (info.width, info.height), float(info.fps))
    table = LabelTable(found.frame, found.ids, found.xy, np.zeros(len(found.ids), np.int32), found.frames)
    try:
        objects = samples.truth_of_rows(table, masks)
    except ValueError as fault:
        raise InputError(
            f"{clip.truth}: does not fit {clip.video.name} ({fault}); render both again"
        ) from fault
    windows = []
    for start, stop in window_bounds(found.frames, found.fps, config):
        tracks = found.window(start, stop)
        first, last = np.searchsorted(found.frame, [start, stop])
        rows = np.zeros((tracks.points, int(masks.max()) + 1), dtype=np.int64)
        np.add.at(rows, (np.searchsorted(tracks.ids, found.ids[first:last]), objects[first:last]), 1)
        lasting = tracks.visible.sum(axis=0) >= max(2, config.least_life * (stop - start))
        if lasting.any():
            truth = rows.argmax(axis=1)[lasting] + 1
            windows.append(LabelledSequence(f"{clip.name}_{start}", "samples", tracks.select(lasting), truth))
    return windows


def sources_of(examples: Sequence[Example]) -> list[str]:
    """Sources that occur, in the order of `SOURCE_WEIGHTS`."""
    present = {example.source for example in examples}
    return [source for source in SOURCE_WEIGHTS if source in present]
