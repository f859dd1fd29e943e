"""How fast the whole program is beside the floor of decoding, tracking and encoding, and how much memory it
takes."""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from tqdm import tqdm

from ifsvideo.benchmark import table, throughput_floor
from ifsvideo.benchmark.memory import MemoryWatch
from ifsvideo.benchmark.options import STATUS, add_config, configuration, length, whole, wholes, write_report
from ifsvideo.benchmark.runner import Report
from ifsvideo.benchmark.throughput_floor import Floor
from ifsvideo.config import Config
from ifsvideo.errors import InputError
from ifsvideo.output.atomic import check_writable
from ifsvideo.pipeline import Pipeline
from ifsvideo.types import VideoInfo
from ifsvideo.video import ffmpeg, open_source
from ifsvideo.worker import Worker

_HELP = """\
Run the whole program on a clip, and the floor, in turn; frames per second are the median of the runs.

The floor (throughput_floor.py) decodes, finds corners, tracks them forward and back, and encodes, and nothing
else. Ratio: how many times longer the program takes. Each runs in a process of its own that is started
before its time begins. Without video: the same, nothing encoded.
Stages: seconds of the program's median run; they run side by side, so that their sum is more than the whole.
Processors: what all processes of either take together; it says more where something else runs beside.
Peak: resident memory of all processes of the program together (pages that they share count for each),
sampled five times a second. Slope: its growth after the first minute of the clip, per minute of the clip;
none of a shorter clip.
"""
_STRETCH_S = 10.0
"""How much of a clip is looped, seconds: ffmpeg holds it in memory to turn it round."""
_MAKE = ("-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-pix_fmt", "yuv420p")


@dataclass(frozen=True)
class Program:
    """One run of the program; ``output`` None leaves the video out."""

    clip: str
    config: Config
    output: str | None
    labels: str


@dataclass(frozen=True)
class Measured:
    """One run of either: frames, seconds, seconds of each stage, processor seconds of all processes together;
    peak (MB) and slope (MB/s) of memory."""

    frames: int
    seconds: float
    stages: dict[str, float]
    cpu: float
    peak: float = 0.0
    slope: float | None = None

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.frames / self.seconds


def run_program(task: Program) -> Measured:
    """The program as the command runs it."""
    pipeline = Pipeline(task.config)
    begun, cpu = time.perf_counter(), _cpu()
    result = pipeline.run(task.clip, task.output, task.labels, keep_table=False)
    return Measured(result.counts.frames, time.perf_counter() - begun, dict(result.seconds), _cpu() - cpu)


def run_floor(task: Floor) -> Measured:
    """The floor."""
    cpu = _cpu()
    frames, seconds = throughput_floor.run(task)
    return Measured(frames, seconds, {}, _cpu() - cpu)


def _cpu() -> float:
    """Processor seconds of this process and of its children that have ended."""
    return sum(os.times()[:4])


def in_a_process(function: Callable[[Any], Measured], task: Any, late: float) -> Measured:
    """Run one of them in a process of its own; from a share ``late`` of its time on memory's slope counts."""
    with Worker(function, "measures") as worker, MemoryWatch(worker.pid) as memory:
        measured = worker(task)
    return replace(measured, peak=memory.peak, slope=memory.slope(late))


def run_throughput(
    clip: Path, config: Config, runs: int, *, video: bool = True, quiet: bool = False
) -> Report:
    """Measure a clip, program and floor in turn.

    Parameters
    ----------
    clip : Path
    config : Config
        Its number of points is the floor's too.
    runs : int
    video : bool
        Whether the overlay is written.
    quiet : bool

    Raises
    ------
    InputError
        If the clip cannot be read, or program and floor decode different numbers of frames.
    """
    info = open_source(clip).info
    length = (info.frames or 0) / float(info.fps)
    late = min(1.0, 60 / max(length, 1e-9))
    own: list[Measured] = []
    floor: list[Measured] = []
    with TemporaryDirectory() as place:
        program_out, floor_out = (str(Path(place) / f"{name}.mp4") if video else None for name in "pf")
        program = Program(str(clip), config, program_out, str(Path(place) / "p.csv"))
        bare = _floor_of(clip, info, config.tracking.max_points, floor_out)
        for _ in tqdm(range(runs), unit="run", disable=quiet):
            floor.append(in_a_process(run_floor, bare, late))
            own.append(in_a_process(run_program, program, late))
    if own[0].frames != floor[0].frames:
        raise InputError(f"{clip}: {own[0].frames} and {floor[0].frames} frames; give one of constant rate")
    typical = sorted(own, key=lambda run: run.seconds)[runs // 2]
    fps, floor_fps = (median(run.fps for run in group) for group in (own, floor))
    slope = None if typical.slope is None else typical.slope * 60 * typical.seconds / max(length, 1e-9)
    return {
        "clip": clip.name,
        "width": info.width,
        "height": info.height,
        "points": config.tracking.max_points,
        "runs": runs,
        "video": video,
        "frames": own[0].frames,
        "fps": fps,
        "floor_fps": floor_fps,
        "ratio": floor_fps / fps,
        "cpu_ms": 1e3 * median(run.cpu / run.frames for run in own),
        "floor_cpu_ms": 1e3 * median(run.cpu / run.frames for run in floor),
        "peak_rss_mb": max(run.peak for run in own),
        "slope_mb_per_minute": slope,
        "stages": {name: round(seconds, 3) for name, seconds in typical.stages.items()},
        "seconds": typical.seconds,
    }


def _floor_of(clip: Path, info: VideoInfo, points: int, output: str | None) -> Floor:
    return Floor(str(clip), info.width, info.height, str(info.fps), points, output)


def looped(clip: Path, minutes: float, height: int | None, folder: Path) -> Path:
    """A clip played forwards and backwards until it is long enough, so that no cut falls in it.

    Parameters
    ----------
    clip : Path
    minutes : float
        Length; 0 leaves it as it is.
    height : int or None
        Height of the picture, pixels; None keeps it.
    folder : Path
        Where it is made.

    Raises
    ------
    InputError
        If ffmpeg cannot make it.
    """
    if not minutes and height is None:
        return clip
    size = "null" if height is None else f"scale=-2:{height}:flags=bicubic"
    source = ["-y", "-i", ffmpeg.file_url(clip)]
    once = folder / "once.mp4"
    if not minutes:
        _make([*source, "-vf", size, *_MAKE, ffmpeg.file_url(once)], clip)
        return once
    turned = f"[0:V:0]trim=end={_STRETCH_S},{size},split[a][b];[b]reverse[c];[a][c]concat[v]"
    _make([*source, "-filter_complex", turned, "-map", "[v]", *_MAKE, ffmpeg.file_url(once)], clip)
    info = open_source(once).info
    rounds = math.ceil(60 * minutes * info.fps / (info.frames or 1))
    whole_length = folder / "looped.mp4"
    loop = ["-y", "-stream_loop", str(rounds - 1), "-i", ffmpeg.file_url(once), "-t", str(60 * minutes)]
    _make([*loop, "-c", "copy", ffmpeg.file_url(whole_length)], clip)
    return whole_length


def _make(arguments: list[str], clip: Path) -> None:
    status, _, complaints = ffmpeg.run(["-loglevel", "error", *arguments])
    if status:
        raise InputError(f"{clip}: cannot be looped or scaled (ffmpeg: {(complaints or ['no reason'])[-1]})")


def parser() -> argparse.ArgumentParser:
    """The options of ``throughput``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark throughput",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("clip", metavar="CLIP", type=Path, help="a video of constant rate")
    add_config(made)
    add = made.add_argument
    add("--points", metavar="N,...", type=wholes(1), help="points tracked at once, by both")
    add("--height", metavar="N,...", type=wholes(16), help="scale the clip to this height before")
    add("--minutes", metavar="N", type=length, default=0.0, help="loop the clip to this length before")
    add("--no-video", action="store_true", help="encode nothing")
    add("--runs", metavar="N", type=whole(1), default=3, help="runs of either (3)")
    add("--json", metavar="FILE", type=Path, help="write all figures there")
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure a clip; prints the figures, and a table with a line for each stage.

    With several heights or numbers of points, each with each, a table of all follows.
    """
    if options.json:
        check_writable(options.json)
    open_source(options.clip)  # what cannot be read is refused before the work, not after it
    config = configuration(options.config)
    reports: list[Report] = []
    for height in options.height or [None]:
        with TemporaryDirectory() as folder:
            clip = looped(options.clip, options.minutes, height, Path(folder))
            for points in options.points or [config.tracking.max_points]:
                own = replace(config, tracking=replace(config.tracking, max_points=points))
                report = run_throughput(clip, own, options.runs, video=not options.no_video)
                reports.append({**report, "clip": options.clip.name})
                print(_in_words(reports[-1]))
    if len(reports) > 1:
        print("\n" + _side_by_side(reports))
    if options.json:
        whole_report = reports[0] if len(reports) == 1 else {"measured": reports}
        write_report(options.json, {"dataset": "throughput", "configuration": options.config, **whole_report})


def _side_by_side(reports: Sequence[Report]) -> str:
    """A line for each report."""
    header = ("picture", "points", "ms a frame", "of the floor", "ratio", "peak MB")
    rows = [
        [
            f"{report['width']}x{report['height']}",
            report["points"],
            *(1e3 / report[name] for name in ("fps", "floor_fps")),
            report["ratio"],
            report["peak_rss_mb"],
        ]
        for report in reports
    ]
    return table.align(header, rows)


def _in_words(report: Report) -> str:
    slope = report["slope_mb_per_minute"]
    size = f"{report['width']}x{report['height']}, {report['points']} points"
    rows = [[name, seconds, 1e3 * seconds / report["frames"]] for name, seconds in report["stages"].items()]
    rows.append(["whole", report["seconds"], 1e3 * report["seconds"] / report["frames"]])
    growth = "" if slope is None else f", {slope:+.1f} MB a minute"
    lines = [
        f"throughput: {report['clip']}, {size}, {report['frames']} frames, median of {report['runs']}",
        "" if report["video"] else "without video\n",
        table.align(("stage", "seconds", "ms a frame"), rows),
        "",
        f"program {report['fps']:.1f} frames/s, floor {report['floor_fps']:.1f}, ratio {report['ratio']:.2f}",
        f"processors, ms a frame: program {report['cpu_ms']:.0f}, floor {report['floor_cpu_ms']:.0f}",
        f"peak memory {report['peak_rss_mb']:.0f} MB{growth}",
    ]
    return "\n".join(lines)
