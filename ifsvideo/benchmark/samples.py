"""Runs the whole pipeline on clips that carry a mask for each frame, and scores every row of the labels."""

from __future__ import annotations

import time
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark import metrics
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.config import Config
from ifsvideo.errors import InputError, UsageError
from ifsvideo.types import LabelTable, Result

_TRUTH = "_truth.npz"


class Runnable(Protocol):
    """What is measured: a `Pipeline`, or anything that runs as one."""

    def run(self, source: Path, *, start: float = 0.0, end: float | None = None) -> Result:
        """Label the points of a video, or of a stretch of it (seconds); writes nothing."""
        ...


@dataclass(frozen=True)
class PipelineFactory:
    """Makes the package's own pipeline for a seed; can be sent to another process."""

    config: Config

    def __call__(self, seed: int) -> Runnable:
        # Imported here because only a worker needs it.
        from ifsvideo.pipeline import Pipeline

        return Pipeline(replace(self.config, seed=seed))


@dataclass(frozen=True)
class ClipRun:
    """One clip, to be run once."""

    name: str
    clip: Path
    truth: Path
    factory: Callable[[int], Runnable]
    seed: int

    def __str__(self) -> str:
        return f"{self.name}, seed {self.seed}"


@dataclass(frozen=True)
class ClipScore:
    """What a run reached on a clip; percentages are None where there is nothing to score.

    Attributes
    ----------
    found : per cent of the rows on moving objects with label > 0.
    false, undecided : per cent of the other rows with label > 0, and with label -1.
    idf1 : identity F1 of the object numbers, per cent.
    objects, true_objects : numbers used in the labels, and in the masks.
    longest_false_s : longest life, seconds, of an object of which less than half the rows move; 0 if none.
    seconds : spent running the pipeline.
    """

    found: float | None
    false: float | None
    undecided: float | None
    idf1: float | None
    objects: float
    true_objects: float
    longest_false_s: float
    seconds: float


def clips(folder: Path, only: str = "*") -> dict[str, tuple[Path, Path]]:
    """Clip and truth of every ``NAME_truth.npz`` of a folder whose name fits a pattern, by name.

    Raises
    ------
    InputError
        If the folder holds no truth, or a clip is missing beside it.
    UsageError
        If no name fits the pattern.
    """
    truths = {file.name.removesuffix(_TRUTH): file for file in sorted(folder.glob(f"*{_TRUTH}"))}
    if not truths:
        raise InputError(f"{folder}: holds no NAME{_TRUTH}; give the folder of the rendered sample clips")
    chosen = {name: (folder / f"{name}.mp4", truths[name]) for name in truths if fnmatchcase(name, only)}
    if not chosen:
        raise UsageError(f"{folder}: no clip is called {only}; there are {', '.join(truths)}")
    for clip, truth in chosen.values():
        if not clip.is_file():
            raise InputError(f"{clip}: is missing beside {truth.name}; render the sample clips again")
    return chosen


def load_masks(file: Path) -> NDArray[np.uint8]:
    """The masks (F, H, W) of a truth file: 0 background, k object k.

    Raises
    ------
    InputError
        If the file cannot be read or holds no such masks.
    """
    try:
        with np.load(file) as content:
            masks: NDArray[np.uint8] = content["masks"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"{file}: holds no masks ({fault}); render the sample clips again") from fault
    if masks.ndim != 3:
        raise InputError(f"{file}: masks have shape {masks.shape}, not (F, H, W); render the clips again")
    return masks


def truth_of_rows(table: LabelTable, masks: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Object (N,) that lies at the rounded position of every row; a point just outside takes the border's.

    Raises
    ------
    ValueError
        If there are not as many masks as frames.
    """
    if table.frames != len(masks):
        raise ValueError(f"{table.frames} frames were decoded, but there are masks for {len(masks)}")
    column, row = np.rint(table.xy).astype(np.int64).T
    height, width = masks.shape[1:]
    inside: NDArray[np.uint8] = masks[table.frame, row.clip(0, height - 1), column.clip(0, width - 1)]
    return inside


def score_rows(table: LabelTable, masks: NDArray[np.uint8], fps: float, seconds: float = 0.0) -> ClipScore:
    """Score every row of the labels of a clip.

    Parameters
    ----------
    table : LabelTable
    masks : (F, H, W) uint8
        0 background, k object k.
    fps : float
        Frames per second of the clip.
    seconds : float
        What the run took, passed on.
    """
    truth = truth_of_rows(table, masks)
    moving, called = truth > 0, table.labels > 0
    return ClipScore(
        found=metrics.percent(int((called & moving).sum()), int(moving.sum())),
        false=metrics.percent(int((called & ~moving).sum()), int((~moving).sum())),
        undecided=metrics.percent(int(((table.labels < 0) & ~moving).sum()), int((~moving).sum())),
        idf1=metrics.idf1(table.labels, truth),
        objects=len(np.unique(table.labels[called])),
        true_objects=len(np.unique(masks[masks > 0])),
        longest_false_s=max(_false_lives(table, moving), default=0) / fps,
        seconds=seconds,
    )


def _false_lives(table: LabelTable, moving: NDArray[np.bool_]) -> list[int]:
    """Frames from first to last sight of each object of which less than half the rows move."""
    lives = []
    for label in np.unique(table.labels[table.labels > 0]):
        own = table.labels == label
        if moving[own].mean() < 0.5:
            seen = table.frame[own]
            lives.append(int(seen[-1] - seen[0]) + 1)
    return lives


def score_clip(run: ClipRun) -> ClipScore:
    """Run the pipeline on one clip and score its rows."""
    masks = load_masks(run.truth)
    pipeline = run.factory(run.seed)
    start = time.perf_counter()
    result = pipeline.run(run.clip)
    seconds = time.perf_counter() - start
    try:
        return score_rows(result.table, masks, float(result.info.fps), seconds)
    except ValueError as fault:
        raise InputError(f"{run.truth}: does not fit {run.clip.name} ({fault}); render both again") from fault


def run_samples(
    chosen: dict[str, tuple[Path, Path]],
    factory: Callable[[int], Runnable],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
) -> Report:
    """Run every clip ``runs`` times, with seeds ``seed``, ``seed + 1``, ..., and report the scores.

    Parameters
    ----------
    chosen : as of `clips`
    factory : callable
        Makes a pipeline for a seed; it must be picklable.
    runs, seed, jobs, quiet : as of `ifsvideo.benchmark.runner.run_points`
    """
    tasks = [
        ClipRun(name, clip, truth, factory, seed + run)
        for name, (clip, truth) in chosen.items()
        for run in range(runs)
    ]
    scores = in_processes(score_clip, tasks, jobs, quiet)
    rows: list[Report] = []
    for place, name in enumerate(chosen):
        own = [asdict(one) for one in scores[place * runs : (place + 1) * runs]]
        rows.append({"name": name, **_mean(own), "by_run": own})
    seconds = sum(one.seconds for one in scores) / runs
    return {"runs": runs, "seed": seed, "seconds": seconds, "mean": _mean(rows), "clips": rows}


def _mean(rows: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    """Mean of every field over the rows that have it."""
    means = {}
    for field in fields(ClipScore):
        values = [row[field.name] for row in rows if row[field.name] is not None]
        means[field.name] = float(np.mean(values)) if values else None
    return means
