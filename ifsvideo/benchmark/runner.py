"""Runs a segmenter over labelled sequences in processes of one thread each, and adds up the scores."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, TypeVar

import cv2
import numpy as np
from tqdm import tqdm

from ifsvideo.benchmark import metrics
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.perturb import UNCHANGED, Perturbation
from ifsvideo.errors import IfsVideoError
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.types import Segmenter

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")
Report = dict[str, Any]
"""What goes into the JSON file."""

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables that a BLAS reads once, when it is loaded."""


@dataclass(frozen=True)
class IFSFactory:
    """Makes the package's own segmenter for a seed; can be sent to another process."""

    config: SegmenterConfig

    def __call__(self, seed: int) -> Segmenter:
        # Imported here because only a worker needs it.
        from ifsvideo.segmenting import TracksSegmenter

        return TracksSegmenter(self.config, seed)


@dataclass(frozen=True)
class Run:
    """One sequence, to be segmented once."""

    sequence: LabelledSequence
    factory: Callable[[int], Segmenter]
    seed: int
    motions: int | None
    perturbation: Perturbation = UNCHANGED

    def __str__(self) -> str:
        return f"{self.sequence.name}, seed {self.seed}"


@dataclass(frozen=True)
class Score:
    """What one run reached: error (per cent), groups found, what moves, seconds spent segmenting."""

    error: float
    estimated: int
    moves: metrics.MovesCount
    seconds: float


def score(run: Run) -> Score:
    """Segment one sequence and compare with its truth."""
    segmenter = run.factory(run.seed)
    tracks = run.perturbation.apply(run.sequence.tracks, run.seed)
    start = time.perf_counter()
    labels = segmenter.segment(tracks, run.motions).labels
    seconds = time.perf_counter() - start
    truth = run.sequence.truth
    return Score(
        metrics.error(labels, truth),
        metrics.group_count(labels, truth),
        metrics.moves(labels, truth),
        seconds,
    )


def in_processes(
    function: Callable[[Task], Outcome],
    tasks: Sequence[Task],
    jobs: int,
    quiet: bool = False,
    title: str | None = None,
) -> list[Outcome]:
    """Apply a function to every task, each in a process with one BLAS and OpenCV thread; keeps the order.

    Even one job gets a process of its own, so that times compare whatever the number of jobs.

    Raises
    ------
    IfsVideoError
        If a process is killed from outside.
    """
    with _one_blas_thread():
        pool = ProcessPoolExecutor(min(jobs, len(tasks)), get_context("spawn"), _start_worker)
        try:
            futures = {pool.submit(function, task): place for place, task in enumerate(tasks)}
            done: dict[int, Outcome] = {}
            for future in tqdm(
                as_completed(futures), title, len(tasks), disable=quiet, unit="run", leave=False
            ):
                fault = future.exception()
                if isinstance(fault, BrokenProcessPool):
                    raise IfsVideoError(
                        "a worker was killed, perhaps for its memory; try fewer --jobs"
                    ) from None
                if fault is not None:
                    fault.add_note(f"while running {tasks[futures[future]]}")
                done[futures[future]] = future.result()
        finally:
            pool.shutdown(cancel_futures=True)
    return [done[place] for place in range(len(tasks))]


def _start_worker() -> None:
    """Leave interrupts to the parent's shutdown: a worker dies at once and silently."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    cv2.setNumThreads(1)


@contextmanager
def _one_blas_thread() -> Iterator[None]:
    """Let processes that are started inside load their BLAS with one thread."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def run_points(
    sequences: Sequence[LabelledSequence],
    factory: Callable[[int], Segmenter],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    motions_known: bool = False,
    quiet: bool = False,
    perturbation: Perturbation = UNCHANGED,
    title: str | None = None,
) -> Report:
    """Segment every sequence ``runs`` times, with seeds ``seed``, ``seed + 1``, ..., and report the scores.

    Parameters
    ----------
    sequences : sequence of LabelledSequence
    factory : callable
        Makes a segmenter for a seed; it must be picklable.
    runs, seed, jobs : int
    motions_known : bool
        Whether the segmenter is told the number of true groups.
    quiet : bool
        Whether progress is kept off stderr.
    perturbation : Perturbation
        What is done to the tracks first, by the run's seed.
    title : str, optional
        What the progress bar is called.
    """
    tasks = [
        Run(sequence, factory, seed + run, sequence.motions if motions_known else None, perturbation)
        for sequence in sequences
        for run in range(runs)
    ]
    scores = in_processes(score, tasks, jobs, quiet, title)
    by_sequence = [scores[start : start + runs] for start in range(0, len(scores), runs)]
    rows = [_row(sequence, reached) for sequence, reached in zip(sequences, by_sequence, strict=True)]
    told = {"motions_known": motions_known, "noise": perturbation.noise, "drop": perturbation.drop}
    return {"runs": runs, "seed": seed, **told, **_totals(rows, scores)}


def _row(sequence: LabelledSequence, reached: Sequence[Score]) -> Report:
    """Scores of one sequence over its runs."""
    errors = [one.error for one in reached]
    return {
        "name": sequence.name,
        "kind": sequence.kind,
        "motions": sequence.motions,
        "points": sequence.tracks.points,
        "labelled": int((sequence.truth > 0).sum()),
        "frames": sequence.tracks.frames,
        "estimated": [one.estimated for one in reached],
        "error": float(np.mean(errors)),
        "errors": errors,
        "one_motion": metrics.error(np.zeros_like(sequence.truth), sequence.truth),
        "moves": sum((one.moves for one in reached), metrics.MovesCount()).as_dict(),
        "seconds": float(np.mean([one.seconds for one in reached])),
    }


def _totals(rows: Sequence[Report], scores: Sequence[Score]) -> Report:
    """Scores over all sequences, by number of motions and by kind."""
    every = _summary(rows)
    numbers = sorted({row["motions"] for row in rows})
    error = {"all": every["error"]}
    error |= {
        str(number): _summary([r for r in rows if r["motions"] == number])["error"] for number in numbers
    }
    return {
        "error": error,
        "median": every["median"],
        "std": every["std"],
        "exact_count": every["exact_count"],
        "one_motion": float(np.mean([row["one_motion"] for row in rows])),
        "moves": sum((one.moves for one in scores), metrics.MovesCount()).as_dict(),
        "seconds": every["seconds"],
        "breakdown": _breakdown(rows),
        "sequences": list(rows),
    }


def _breakdown(rows: Sequence[Report]) -> list[Report]:
    """One summary for each kind and number of motions that occur, "all" first."""
    table = []
    for kind in ("all", *sorted({row["kind"] for row in rows})):
        of_kind = [row for row in rows if kind in ("all", row["kind"])]
        for motions in ("all", *sorted({row["motions"] for row in of_kind})):
            chosen = [row for row in of_kind if motions in ("all", row["motions"])]
            table.append(
                {"kind": kind, "motions": str(motions), "sequences": len(chosen), **_summary(chosen)}
            )
    return table


def _summary(rows: Sequence[Report]) -> dict[str, float]:
    """Mean and median over sequences, standard deviation of the mean over runs, per cent of (sequence, run)
    pairs with the right number of groups, seconds of one run."""
    exact = [count == row["motions"] for row in rows for count in row["estimated"]]
    errors = [row["error"] for row in rows]
    return {
        "error": float(np.mean(errors)),
        "median": float(np.median(errors)),
        "std": float(np.std(np.mean([row["errors"] for row in rows], axis=0))),
        "exact_count": 100.0 * float(np.mean(exact)),
        "seconds": float(sum(row["seconds"] for row in rows)),
    }
