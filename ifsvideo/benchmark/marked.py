"""Runs the whole pipeline on real clips in which what moves was marked by hand."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ifsvideo.benchmark import metrics, table
from ifsvideo.benchmark.marking import MOVES, STANDS, Marks, marks_of
from ifsvideo.benchmark.options import STATUS, add_config, add_runs, configuration, tell
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.benchmark.samples import PipelineFactory, Runnable
from ifsvideo.types import BACKGROUND, LabelTable
from ifsvideo.video import open_source

_HELP = """\
Run the whole pipeline on real clips in which what moves was marked by hand.

The clips are no part of the package, only coordinates are (ifsvideo/benchmark/marks); a clip is known by its
name:

static_pedestrians.avi  a camera that stands still, people walk; boxes round them in 20 frames
davis_car_shadow        folder with frames/ and masks gt/; not counted are 5 pixels along a mask's border, and
                        what moves besides, in boxes

Found: per cent of the points on what is marked with a label > 0, -1 being wrong. False and undecided: per
cent of the other points with a label > 0, and with -1. Only points of frames that are marked count. Mean over
runs; run r uses seed S + r.
"""


@dataclass(frozen=True)
class MarkedScore:
    """What a run reached; percentages are None where there is nothing to score.

    Attributes
    ----------
    found : per cent of the points that move with label > 0.
    false, undecided : per cent of the others with label > 0, and with label -1.
    moving, others : points counted.
    """

    found: float | None
    false: float | None
    undecided: float | None
    moving: float
    others: float


@dataclass(frozen=True)
class MarkedRun:
    """One clip, to be run once."""

    place: Path
    marks: Marks
    factory: Callable[[int], Runnable]
    seed: int

    def __str__(self) -> str:
        return f"{self.place.name}, seed {self.seed}"


def score(rows: LabelTable, marks: Marks, place: Path) -> MarkedScore:
    """Compare the labels of a clip with its marks."""
    truth = marks.truth(rows, place)
    moves, stands = truth == MOVES, truth == STANDS
    called, undecided = rows.labels > BACKGROUND, rows.labels < BACKGROUND
    moving, others = int(moves.sum()), int(stands.sum())
    return MarkedScore(
        found=metrics.percent(int((moves & called).sum()), moving),
        false=metrics.percent(int((stands & called).sum()), others),
        undecided=metrics.percent(int((stands & undecided).sum()), others),
        moving=moving,
        others=others,
    )


def run_marked(
    places: Sequence[Path],
    factory: Callable[[int], Runnable],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
) -> Report:
    """Run every clip ``runs`` times, with seeds ``seed``, ``seed + 1``, ..., and report the means.

    Parameters
    ----------
    places : sequence of Path
        Clips, or folders of clips with masks, that somebody marked.
    factory, runs, seed, jobs, quiet : as of `ifsvideo.benchmark.samples.run_samples`

    Raises
    ------
    InputError
        If nobody marked a clip of that name, or clip or masks cannot be read.
    """
    tasks = [
        MarkedRun(place, marks_of(place), factory, seed + run) for place in places for run in range(runs)
    ]
    for task in tasks:  # refused before the work, not after it
        open_source(task.place / task.marks.clip)
    scores = in_processes(_run, tasks, jobs, quiet)
    rows: list[Report] = []
    for index, place in enumerate(places):
        own = [asdict(one) for one in scores[index * runs : (index + 1) * runs]]
        rows.append({"name": place.name, **_mean(own), "by_run": own})
    return {"runs": runs, "seed": seed, "clips": rows}


def _run(task: MarkedRun) -> MarkedScore:
    result = task.factory(task.seed).run(task.place / task.marks.clip)
    return score(result.table, task.marks, task.place)


def _mean(runs: Sequence[Report]) -> Report:
    """Mean of every field. Tracks do not depend on the seed: all runs have something to score, or none."""
    return {
        field: None if runs[0][field] is None else float(np.mean([one[field] for one in runs]))
        for field in runs[0]
    }


def parser() -> argparse.ArgumentParser:
    """The options of ``marked``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark marked",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("clips", metavar="CLIP", type=Path, nargs="+", help="a clip, or folder, of these names")
    add_config(made)
    add_runs(made)
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure clips; prints a table with a line for each."""

    def scores() -> Report:
        factory = PipelineFactory(configuration(options.config))
        return run_marked(options.clips, factory, options.runs, options.seed, options.jobs)

    tell("marked", options, scores, as_table)


def as_table(report: Report) -> str:
    """A line for each clip."""
    columns = {
        "clip": "name",
        "found %": "found",
        "false %": "false",
        "undecided %": "undecided",
        "moving points": "moving",
        "others": "others",
    }
    rows = [[line[field] for field in columns.values()] for line in report["clips"]]
    runs = "1 run" if report["runs"] == 1 else f"{report['runs']} runs"
    return f"marked: {len(rows)} clips, {runs}\n\n{table.align(tuple(columns), rows)}"
