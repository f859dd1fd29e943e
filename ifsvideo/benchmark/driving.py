"""Runs the whole program on the frames of KT3DMoSeg; its points speak for the labelled ones near them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.benchmark import metrics
from ifsvideo.benchmark.datasets import LabelledSequence, frames_of
from ifsvideo.benchmark.metrics import MovesCount
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.benchmark.samples import Runnable
from ifsvideo.benchmark.side_by_side import overlay_file, table_of, write_side_by_side
from ifsvideo.errors import InputError
from ifsvideo.types import LabelTable
from ifsvideo.video import open_source

REACH = 10.0
"""Farthest that an own point may be from a labelled one to speak for it, pixels."""
_NOTHING_NEAR = -2


@dataclass(frozen=True)
class FramesScore:
    """What a run reached on the labelled points of a clip, each counted in every frame in which it is seen.

    Attributes
    ----------
    error : per cent, as of `ifsvideo.benchmark.metrics.error`, over the covered ones; None where none is.
    moves : count of those that truly move and that are called moving, over the covered ones.
    covered : labelled points that have an own point within `REACH` in the same frame.
    labelled : all of them.
    """

    error: float | None
    moves: MovesCount
    covered: int
    labelled: int


@dataclass(frozen=True)
class FramesRun:
    """One clip, to be run once; ``overlay`` is where truth and result are drawn, if they are."""

    sequence: LabelledSequence
    frames: Path
    factory: Callable[[int], Runnable]
    seed: int
    overlay: Path | None = None

    def __str__(self) -> str:
        return f"{self.sequence.name}, seed {self.seed}"


def check_frames(sequences: Sequence[LabelledSequence], folder: Path) -> None:
    """Refuse a data set without the frames of every sequence.

    Raises
    ------
    InputError
        If a folder of frames is missing or holds none.
    """
    for sequence in sequences:
        open_source(frames_of(folder, sequence.name))


def nearest_labels(table: LabelTable, sequence: LabelledSequence) -> NDArray[np.int64]:
    """Label of the own point nearest to each labelled one, in each frame.

    Returns
    -------
    (F, P) int64
        -2 where there is none within `REACH`, or where the track is not seen.
    """
    tracks = sequence.tracks
    found = np.full(tracks.visible.shape, _NOTHING_NEAR, dtype=np.int64)
    for frame in range(tracks.frames):
        rows = table.at(frame)
        seen = np.flatnonzero(tracks.visible[frame])
        if rows.start == rows.stop or not len(seen):
            continue
        distance, place = cKDTree(table.xy[rows]).query(tracks.xy[frame, seen])
        near = np.asarray(distance) <= REACH
        found[frame, seen[near]] = table.labels[rows][np.asarray(place)[near]]
    return found


def score_frames(table: LabelTable, sequence: LabelledSequence) -> FramesScore:
    """Compare the labels of a run with the truth of the tracks."""
    labels = nearest_labels(table, sequence)
    labelled = sequence.tracks.visible & (sequence.truth > 0)
    covered = labelled & (labels != _NOTHING_NEAR)
    estimated, true = labels[covered], np.broadcast_to(sequence.truth, labels.shape)[covered]
    error = metrics.error(estimated, true) if len(true) else None
    return FramesScore(error, metrics.moves(estimated, true), int(covered.sum()), int(labelled.sum()))


def run_frames(
    sequences: Sequence[LabelledSequence],
    folder: Path,
    factory: Callable[[int], Runnable],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
    overlay: Path | None = None,
) -> Report:
    """Run the program on the frames of every sequence, with seeds ``seed``, ``seed + 1``, ...

    Parameters
    ----------
    folder : Path
        Where the data set lies.
    overlay : Path, optional
        Folder into which truth and result of the first seed are drawn, side by side.
    sequences, factory, runs, seed, jobs, quiet : as of `ifsvideo.benchmark.runner.run_points`

    Returns
    -------
    Report
        ``error`` (per cent, mean over runs, then sequences), ``precision``, ``recall`` and ``coverage`` (per
        cent over all sequences and runs together), and the same of each sequence.

    Raises
    ------
    InputError
        If frames cannot be read, or are not as many as the tracks have.
    """
    tasks = [
        FramesRun(
            sequence,
            frames_of(folder, sequence.name),
            factory,
            seed + run,
            overlay_file(overlay, sequence.name) if overlay and run == 0 else None,
        )
        for sequence in sequences
        for run in range(runs)
    ]
    scores = in_processes(_run, tasks, jobs, quiet, "whole program")
    rows: list[Report] = []
    for place, sequence in enumerate(sequences):
        rows.append({"name": sequence.name, **_figures(scores[place * runs : (place + 1) * runs])})
    errors = [row["error"] for row in rows if row["error"] is not None]
    total = {**_figures(scores), "error": float(np.mean(errors)) if errors else None}
    return {**total, "sequences": rows}


def _run(task: FramesRun) -> FramesScore:
    result = task.factory(task.seed).run(task.frames)
    expected = task.sequence.tracks.frames
    if result.table.frames != expected:
        raise InputError(
            f"{task.frames}: holds {result.table.frames} frames, but the tracks {expected}; fetch both again"
        )
    if task.overlay:
        truth = table_of(task.sequence.tracks, task.sequence.truth - 1)
        write_side_by_side(task.overlay, open_source(task.frames), truth, result.table)
    return score_frames(result.table, task.sequence)


def _figures(scores: Sequence[FramesScore]) -> Report:
    """Several scores as one."""
    errors = [one.error for one in scores if one.error is not None]
    covered, labelled = (sum(getattr(one, name) for one in scores) for name in ("covered", "labelled"))
    return {
        "error": float(np.mean(errors)) if errors else None,
        **sum((one.moves for one in scores), MovesCount()).as_dict(),
        "coverage": metrics.percent(covered, labelled),
    }
