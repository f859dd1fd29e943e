"""What the further outputs cost: runs with the overlay alone, and with all of them, in turn."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from tqdm import tqdm

from ifsvideo.benchmark import table
from ifsvideo.benchmark.options import STATUS, add_config, configuration, tell, whole
from ifsvideo.benchmark.runner import Report
from ifsvideo.output.products import ENDINGS, Products
from ifsvideo.pipeline import Pipeline
from ifsvideo.video import open_source

_HELP = """\
Run the whole program on a video with overlay and labels alone, and with every further output, in turn.

Seconds: median of the runs, wall clock. Ratio: of the two. Written are overlay, labels, objects, MOTChallenge
rows, summary, masks, tracks, clips and page, into a folder that is removed in the end.
"""


def all_products(folder: Path) -> Products:
    """Every further output, in a folder."""
    names = [item.name for item in fields(Products)]
    return Products(**{name: folder / f"{name}{ENDINGS.get(name, '')}" for name in names})


def run_cost(clip: Path, pipeline: Pipeline, runs: int, quiet: bool = False) -> Report:
    """Measure a video ``runs`` times in either way; the first of each is not kept apart.

    Raises
    ------
    InputError
        If the video cannot be read.
    """
    ways: Mapping[str, Callable[[Path], Products]] = {
        "overlay and labels": lambda folder: Products(),
        "everything": all_products,
    }
    seconds: dict[str, list[float]] = {way: [] for way in ways}
    for way in tqdm([*ways] * runs, unit="run", disable=quiet):
        with TemporaryDirectory() as place:
            folder, begun = Path(place), time.perf_counter()
            pipeline.run(clip, folder / "o.mp4", folder / "o.csv", products=ways[way](folder))
            seconds[way].append(time.perf_counter() - begun)
    alone, everything = (median(seconds[way]) for way in ways)
    return {"clip": clip.name, "runs": runs, "seconds": seconds, "ratio": everything / alone}


def parser() -> argparse.ArgumentParser:
    """The options of ``cost``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark cost",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("clip", metavar="CLIP", type=Path, help="a video")
    add_config(made)
    made.add_argument("--runs", metavar="N", type=whole(1), default=3, help="runs in either way (3)")
    made.add_argument("--json", metavar="FILE", type=Path, help="write all figures there")
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure a video; prints a table with a line for each way."""

    def scores() -> Report:
        open_source(options.clip)  # what cannot be read is refused before the work, not after it
        return run_cost(options.clip, Pipeline(configuration(options.config)), options.runs)

    tell("cost", options, scores, as_table)


def as_table(report: Report) -> str:
    """A line for each way, and the ratio."""
    rows = [[way, median(seconds)] for way, seconds in report["seconds"].items()]
    title = f"cost: {report['clip']}, median of {report['runs']}"
    return f"{title}\n\n{table.align(('written', 'seconds'), rows)}\n\nratio: {report['ratio']:.2f}"
