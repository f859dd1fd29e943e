"""Measure the segmenter on data whose truth is known; a table to stdout, the same figures to a JSON file.

hopkins155  DIR holds NAME/NAME_truth.mat
kt3dmoseg   DIR holds NAME_Tracks.mat, and frames, where there are, under OriginalSequences/NAME/
samples     DIR holds NAME.mp4 and NAME_truth.npz (masks (F, H, W) uint8: 0 background, k object k)

Scoring of hopkins155 and kt3dmoseg. Error of one sequence, per cent: 100 x (1 - the greatest number of
points that a one-to-one matching of estimated to true labels gets right / labelled points), -1 counting as
wrong, true label 0 not counted; averaged over runs, then over sequences. Exact count: per cent of
(sequence, run) pairs with the right number of groups among the labelled points, background included.
Seconds: spent segmenting, on one thread, summed over the sequences, of one run. Std: of the mean error,
over runs. Moves: a point is truly moving if its group is not 1, called moving if its label is > 0;
precision and recall in per cent over the points of all sequences and runs together. All one motion: the
error of calling everything background.

Scoring of samples. The whole pipeline runs on each clip, and every row of the labels is compared with the
mask at its rounded position (all rows count, also those at a mask's border); a row truly moves if the mask
is > 0 there. Found: per cent of the moving rows with label > 0 (-1 is wrong). False and undecided: per cent
of the other rows with label > 0, and with -1. IDF1: 100 x 2 IDTP / (2 IDTP + IDFP + IDFN), moving rows as
truth, rows with label > 0 as predictions, IDTP the rows that the best one-to-one matching of object to mask
numbers over the whole clip gets right. Longest false: the longest life, in seconds, of an object of which
less than half the rows move. Mean over runs, then over clips.

Run r uses seed S + r.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ifsvideo.benchmark import datasets, samples, table
from ifsvideo.benchmark.runner import IFSFactory, Report, run_points
from ifsvideo.config import Config
from ifsvideo.config_file import load_config
from ifsvideo.errors import IfsVideoError, OutputError, UsageError
from ifsvideo.segmentation.config import SegmenterConfig


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit status, as `ifsvideo` does."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, _terminate)
    try:
        _check_output(options.json)
        report = {"dataset": options.dataset, **_measure(options, _configuration(options.config))}
        print(_as_table(report, options.verbose))
        if options.json:
            _write(options.json, report)
    except IfsVideoError as fault:
        print(f"error: {fault}", file=sys.stderr)
        return fault.exit_status
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("dataset", metavar="DATASET", choices=("hopkins155", "kt3dmoseg", "samples"))
    parser.add_argument("folder", metavar="DIR", type=Path, help="where the data set lies")
    parser.add_argument("--runs", metavar="N", type=_positive, default=1, help="runs of every sequence (1)")
    parser.add_argument("--seed", metavar="S", type=int, default=0, help="seed of the first run (0)")
    parser.add_argument(
        "--jobs", metavar="N", type=_positive, default=os.cpu_count() or 1, help="processes (all CPUs)"
    )
    parser.add_argument(
        "--motions-known", action="store_true", help="tell the segmenter the number of motions"
    )
    parser.add_argument(
        "--config", metavar="FILE", default="default", help='a TOML file, or "thesis" or "default" (default)'
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all figures there")
    parser.add_argument("--only", metavar="NAME-GLOB", default="*", help="only sequences with such a name")
    parser.add_argument("--verbose", action="store_true", help="a line for each sequence of hopkins155, too")
    return parser


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


def _terminate(*_: object) -> NoReturn:
    """Unwind on SIGTERM, so that no worker stays behind."""
    sys.exit(143)


def _measure(options: argparse.Namespace, config: Config) -> Report:
    if options.dataset == "samples":
        if options.motions_known:
            raise UsageError(
                "--motions-known: the number changes along a clip; leave the option out for samples"
            )
        chosen = samples.clips(options.folder, options.only)
        factory = samples.PipelineFactory(config)
        return samples.run_samples(chosen, factory, options.runs, options.seed, options.jobs)
    sequences = datasets.load(options.dataset, options.folder, options.only)
    make = IFSFactory(config.segmentation)
    return run_points(sequences, make, options.runs, options.seed, options.jobs, options.motions_known)


def _as_table(report: Report, verbose: bool) -> str:
    if report["dataset"] == "samples":
        return table.samples(report)
    return table.points(report, by_sequence=verbose or report["dataset"] == "kt3dmoseg")


def _configuration(name: str) -> Config:
    """The configuration called ``thesis`` or ``default``, or that of a TOML file."""
    if name == "default":
        return Config()
    if name == "thesis":
        return Config(segmentation=SegmenterConfig.thesis())
    return load_config(name)


def _check_output(path: Path | None) -> None:
    """Refuse a place that cannot be written before the work, not after it."""
    if path and (path.is_dir() or not os.access(path.absolute().parent, os.W_OK)):
        raise OutputError(
            f"{path}: cannot be written; give a file in a folder that exists and may be written"
        )


def _write(path: Path, report: Report) -> None:
    """Write the report beside its place and move it there when complete."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(json.dumps(report, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as fault:
        raise OutputError(f"{path}: cannot be written ({fault.strerror}); choose another place") from fault
    finally:
        part.unlink(missing_ok=True)


if __name__ == "__main__":
    sys.exit(main())
