"""Measures a page of many objects in a real browser: how large it is, and how soon it is there."""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from ifsvideo.benchmark import browser
from ifsvideo.benchmark.options import STATUS, tell, whole
from ifsvideo.benchmark.runner import Report
from ifsvideo.objects.history import ObjectHistory
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.scenes import Scenes
from ifsvideo.report import ReportSink
from ifsvideo.types import FramePoints, Image, Scene, VideoInfo

_HELP = """\
Write the page of a clip that is made up, and open it in Chromium, headless.

The clip is 640x360 at 25 frames a second; each object is 20 points that are in sight for a tenth of it, or
for two seconds, and move, and grow or shrink. Size: of the page, without its video.
Seconds: from the address to the load event and the video's first picture, median of the runs. Without
chromium and chromedriver (Debian's packages chromium and chromium-driver) only the size is told.
"""
_INFO = VideoInfo(640, 360, Fraction(25))
_GROUND, _POINTS = 100, 20
_READY = "const v = document.getElementById('video'); return v.readyState >= 2 && !v.seeking"


def scenes(objects: int, frames: int, seed: int = 0) -> Iterator[Scene]:
    """The scenes of the clip; every object is in sight at some time."""
    rng = np.random.default_rng(seed)
    size = np.array([_INFO.width, _INFO.height])
    ground = rng.uniform((0, 0), size, (_GROUND, 2))
    shape = rng.uniform(-20, 20, (objects, _POINTS, 2))
    lasting = max(round(2 * _INFO.fps), frames // 10)
    first = np.sort(rng.integers(0, max(1, frames - lasting), objects))
    start, stop = rng.uniform((60, 60), size - 60, (2, objects, 2))
    growth = rng.uniform(-1, 1, objects)
    past = Scenes(_INFO, 0.0)
    for frame in range(frames):
        shown = np.flatnonzero((first <= frame) & (frame < first + lasting))
        share = ((frame - first[shown]) / lasting)[:, None, None]
        middle = start[shown, None] + share * (stop - start)[shown, None]
        xy = middle + shape[shown] * np.exp(share * growth[shown, None, None])
        ids = 1000 * (shown + 1)[:, None] + np.arange(_POINTS)
        points = FramePoints(
            np.concatenate([np.arange(_GROUND), ids.ravel()]),
            np.concatenate([ground, xy.reshape(-1, 2)]).astype(np.float32),
        )
        labels = np.concatenate([np.zeros(_GROUND, int), np.repeat(shown + 1, _POINTS)])
        yield past.next(points, labels.astype(np.int32))


def wall(frames: int) -> Iterator[Image]:
    """Pictures of a wall of soft colours that goes by, and begins anew."""
    x, y = np.meshgrid(np.arange(2 * _INFO.width), np.arange(_INFO.height), sparse=True)
    turns = 2 * np.pi * 4 / _INFO.width
    grey: NDArray[np.float64] = 128 + 50 * np.sin(turns * x) + 50 * np.sin(y / 17)
    wide = np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)
    for frame in range(frames):
        left = 2 * frame % _INFO.width
        yield np.ascontiguousarray(wide[:, left : left + _INFO.width])


def write_page(path: Path, objects: int, frames: int, quiet: bool = False) -> None:
    """Write the page of the clip as a run of the program would."""
    with Outputs() as outputs:
        history = ObjectHistory(_INFO, thumbnails=True)
        sink = ReportSink(path, "made up", _INFO, history, outputs)
        clip = zip(scenes(objects, frames), wall(frames), strict=False)
        for scene, image in tqdm(clip, total=frames, unit="frame", disable=quiet, leave=False):
            history.add(scene, image)
            sink.add(scene, image)
        history.finish()
        sink.finish()


def opening_times(page: Path, runs: int) -> list[float]:
    """Seconds from the address of a page to its being there, of each run."""
    seconds = []
    with TemporaryDirectory() as folder, browser.browser(Path(folder)) as window:
        for _ in range(runs):
            window.open("about:blank")
            begun = time.perf_counter()
            window.open(page.as_uri())
            window.until(_READY)
            seconds.append(time.perf_counter() - begun)
    return seconds


def run_page(objects: int, minutes: float, runs: int, quiet: bool = False) -> Report:
    """Write the page and measure it; ``seconds`` is empty where there is no browser."""
    frames = max(2, round(60 * minutes * _INFO.fps))
    with TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        write_page(page, objects, frames, quiet)
        seconds = opening_times(page, runs) if browser.HERE else []
        size = page.stat().st_size
        embedded = re.search('src="(data:video/[^"]*)"', page.read_text(encoding="utf-8"))
        video = len(embedded[1]) if embedded else 0
    figures = {"bytes": size - video, "embedded_video_bytes": video, "seconds": seconds}
    return {"objects": objects, "minutes": minutes, "runs": runs, **figures}


def parser() -> argparse.ArgumentParser:
    """The options of ``page``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark page",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = made.add_argument
    add("--minutes", metavar="N", type=whole(1), default=10, help="length of the clip (10)")
    add("--objects", metavar="N", type=whole(1), default=60, help="objects in it (60)")
    add("--runs", metavar="N", type=whole(1), default=5, help="how often it is opened (5)")
    add("--json", metavar="FILE", type=Path, help="write all figures there")
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure a page; prints its size and how soon it is there."""
    tell("page", options, lambda: run_page(options.objects, options.minutes, options.runs), as_table)


def as_table(report: Report) -> str:
    """Size, and how soon it is there."""
    opened = "not measured, there is no chromium with chromedriver here"
    if report["seconds"]:
        opened = f"{median(report['seconds']):.2f} s, median of {report['runs']}"
    title = f"page: {report['minutes']} minutes, {report['objects']} objects"
    size = f"{report['bytes'] / 1e6:.2f} MB, and {report['embedded_video_bytes'] / 1e6:.2f} MB of video in it"
    return f"{title}\n\nsize: {size}\nopen after: {opened}"
