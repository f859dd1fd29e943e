"""Runs the whole pipeline on clips in which nothing moves by itself: whatever is called moving is wrong."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ifsvideo.benchmark import metrics, table
from ifsvideo.benchmark.options import STATUS, add_config, add_runs, configuration, seconds, tell
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.benchmark.samples import PipelineFactory, Runnable
from ifsvideo.types import BACKGROUND, Result
from ifsvideo.video import open_source

_HELP = """\
Run the whole pipeline on clips in which nothing moves by itself.

Moving: per cent of all rows of the labels with a label > 0, each of them wrong. Undecided: per cent with -1.
Objects: how many numbers are used. Longest: the longest time from an object's first sight to its last. Mean
over runs; run r uses seed S + r. --start and --end hold for every clip.
"""


@dataclass(frozen=True)
class StaticScore:
    """What a run called moving where nothing does.

    Attributes
    ----------
    moving_percent, undecided_percent : per cent of all rows with label > 0, and with -1; 0 without a row.
    objects : object numbers used.
    longest_s : longest time, seconds, from the first frame of an object to the end of its last; 0 if none.
    """

    moving_percent: float
    undecided_percent: float
    objects: float
    longest_s: float


@dataclass(frozen=True)
class StaticRun:
    """One clip, a stretch of it, to be run once."""

    clip: Path
    start: float
    end: float | None
    factory: Callable[[int], Runnable]
    seed: int

    def __str__(self) -> str:
        return f"{self.clip.name}, seed {self.seed}"


def score(result: Result) -> StaticScore:
    """Count what a result calls moving."""
    labels, frame = result.table.labels, result.table.frame
    objects = np.unique(labels[labels > BACKGROUND])
    lives = [int(np.ptp(frame[labels == label])) + 1 for label in objects]
    return StaticScore(
        moving_percent=metrics.percent(int((labels > BACKGROUND).sum()), len(labels)) or 0.0,
        undecided_percent=metrics.percent(int((labels < BACKGROUND).sum()), len(labels)) or 0.0,
        objects=len(objects),
        longest_s=float(max(lives, default=0) / result.info.fps),
    )


def run_static(
    clips: Sequence[Path],
    factory: Callable[[int], Runnable],
    start: float = 0.0,
    end: float | None = None,
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
) -> Report:
    """Run every clip ``runs`` times, with seeds ``seed``, ``seed + 1``, ..., and report the means.

    Parameters
    ----------
    clips : sequence of Path
        Videos or folders of images.
    start, end : float
        Stretch of each clip, seconds.
    factory, runs, seed, jobs, quiet : as of `ifsvideo.benchmark.samples.run_samples`
    """
    tasks = [StaticRun(clip, start, end, factory, seed + run) for clip in clips for run in range(runs)]
    scores = in_processes(_run, tasks, jobs, quiet)
    rows = []
    for place, clip in enumerate(clips):
        own = [asdict(one) for one in scores[place * runs : (place + 1) * runs]]
        mean = {field: float(np.mean([one[field] for one in own])) for field in own[0]}
        rows.append({"name": clip.name, **mean, "by_run": own})
    return {"runs": runs, "seed": seed, "start": start, "end": end, "clips": rows}


def _run(task: StaticRun) -> StaticScore:
    return score(task.factory(task.seed).run(task.clip, start=task.start, end=task.end))


def parser() -> argparse.ArgumentParser:
    """The options of ``static``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark static",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("clips", metavar="CLIP", type=Path, nargs="+", help="a video, or a folder of images")
    made.add_argument(
        "--start", metavar="TIME", type=seconds, default=0.0, help="begin here: seconds, or 1:02.5"
    )
    made.add_argument("--end", metavar="TIME", type=seconds, help="stop before this time")
    add_config(made)
    add_runs(made)
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure clips; prints a table with a line for each."""

    def scores() -> Report:
        for clip in options.clips:  # what cannot be read is refused before the work, not after it
            open_source(clip, start=options.start, end=options.end)
        factory = PipelineFactory(configuration(options.config))
        stretch = options.start, options.end
        return run_static(options.clips, factory, *stretch, options.runs, options.seed, options.jobs)

    tell("static", options, scores, as_table)


def as_table(report: Report) -> str:
    """A line for each clip."""
    columns = {
        "clip": "name",
        "moving %": "moving_percent",
        "undecided %": "undecided_percent",
        "objects": "objects",
        "longest s": "longest_s",
    }
    rows = [[line[field] for field in columns.values()] for line in report["clips"]]
    runs = "1 run" if report["runs"] == 1 else f"{report['runs']} runs"
    return f"static: {len(rows)} clips, {runs}\n\n{table.align(tuple(columns), rows)}"
