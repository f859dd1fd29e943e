"""Options that several commands of the benchmark share, and what becomes of them."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from pathlib import Path

from ifsvideo.benchmark.runner import Report
from ifsvideo.config import Config
from ifsvideo.config_file import load_config
from ifsvideo.errors import OutputError, UsageError
from ifsvideo.output.atomic import check_writable, output_error, replacing
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.video import parse_time

STATUS = """\
exit status: 0 done; 1 fault of the program; 2 wrong use, or --plot without matplotlib; 3 input cannot be
read; 4 output cannot be written; 130, 143 interrupted
"""


def add_runs(parser: argparse.ArgumentParser) -> None:
    """How often, from which seed, in how many processes, and where the figures go."""
    add = parser.add_argument
    add("--runs", metavar="N", type=whole(1), default=1, help="runs of every sequence (1)")
    add("--seed", metavar="S", type=whole(0), default=0, help="seed of the first run (0)")
    add("--jobs", metavar="N", type=whole(1), default=os.cpu_count() or 1, help="processes (all CPUs)")
    add("--json", metavar="FILE", type=Path, help="write all figures there")


def add_only(parser: argparse.ArgumentParser) -> None:
    """Which sequences of a data set."""
    parser.add_argument("--only", metavar="NAME-GLOB", default="*", help="only sequences with such a name")


def add_config(parser: argparse.ArgumentParser) -> None:
    """Which settings; `configuration` reads them."""
    text = 'a TOML file, or "thesis" or "default" (default)'
    parser.add_argument("--config", metavar="FILE", default="default", help=text)


def configuration(name: str) -> Config:
    """The configuration called ``thesis`` or ``default``, or that of a TOML file."""
    if name == "default":
        return Config()
    if name == "thesis":
        return Config(segmentation=SegmenterConfig.thesis())
    return load_config(name)


def whole(least: int) -> Callable[[str], int]:
    """A converter to whole numbers of at least ``least``."""

    def convert(text: str) -> int:
        if not (text.isascii() and text.isdigit()) or int(text) < least:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
        return int(text)

    return convert


def wholes(least: int) -> Callable[[str], list[int]]:
    """A converter to several whole numbers of at least ``least``, with commas between them."""
    one = whole(least)
    return lambda text: [one(part) for part in text.split(",")]


def length(text: str) -> float:
    """A converter to a number of 0 or more."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of 0 or more")
    return value


def seconds(text: str) -> float:
    """A converter of times as the command ``ifsvideo`` takes them."""
    try:
        return parse_time(text)
    except UsageError as fault:
        raise argparse.ArgumentTypeError(str(fault)) from None


def made_folder(path: Path) -> Path:
    """A folder for files of several names, made where it is missing.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    try:
        path.mkdir(exist_ok=True)
    except OSError as fault:
        raise OutputError(f"{path}: cannot be made ({fault.strerror}); name another folder") from fault
    return path


def tell(
    dataset: str, options: argparse.Namespace, scores: Callable[[], Report], as_table: Callable[[Report], str]
) -> None:
    """Measure, print a table, write the figures where ``--json`` says; whether they can be is asked first.

    Parameters
    ----------
    dataset : str
        What the report is of.
    options : argparse.Namespace
        With ``json`` and, where there is one, ``config``.
    scores : callable
        Measures.
    as_table : callable
        The report for people.
    """
    if options.json:
        check_writable(options.json)
    report: Report = {"dataset": dataset}
    if "config" in options:
        report["configuration"] = options.config
    report |= scores()
    print(as_table(report))
    if options.json:
        write_report(options.json, report)


def write_report(path: Path, report: Report) -> None:
    """Write the report as JSON."""
    write_text(path, json.dumps(report, indent=1, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a file; an older one stands until the new one is complete."""
    with replacing(path) as part:
        try:
            part.write_text(text, encoding="utf-8")
        except OSError as fault:
            raise output_error(path, fault) from fault
