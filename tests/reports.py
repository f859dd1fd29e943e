"""Pages of clips that are made up: patches of points that move over a still ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.objects.history import ObjectHistory, ObjectTable
from ifsvideo.output.atomic import Outputs
from ifsvideo.report import ReportSink
from ifsvideo.types import Scene, VideoInfo

from .conftest import texture

INFO = VideoInfo(320, 240, Fraction(20))
_SIDE = 24


@dataclass(frozen=True)
class Mover:
    """A square of points: its middle in frame 0 (pixels), steps a frame, frames in which it is seen."""

    start: tuple[float, float]
    step: tuple[float, float]
    first: int = 0
    last: int = 10_000
    growth: float = 0.0


def scenes(movers: Sequence[Mover], frames: int) -> Iterator[Scene]:
    """The scenes of a clip in which the movers are the objects 1, 2, ..."""
    ground = np.random.default_rng(1).uniform((0, 0), (INFO.width, INFO.height), (60, 2))
    place = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 4)] * 2), axis=-1).reshape(-1, 2)
    for frame in range(frames):
        xy, labels, ids = [ground], [np.zeros(60, int)], [np.arange(60)]
        for number, mover in enumerate(movers, 1):
            if mover.first <= frame <= mover.last:
                middle = np.array(mover.start) + frame * np.array(mover.step)
                xy.append(middle + place * _SIDE * np.exp(mover.growth * frame / float(INFO.fps)))
                labels.append(np.full(16, number))
                ids.append(1000 * number + np.arange(16))
        points = np.concatenate(xy).astype(np.float32)
        yield Scene(
            frame,
            INFO.time_of(frame),
            np.concatenate(ids),
            points,
            np.concatenate(labels).astype(np.int32),
            points[None],
        )


def make_report(
    path: Path,
    movers: Sequence[Mover],
    frames: int,
    *,
    name: str = "clip.mp4",
    pictures: bool = True,
    sound: Path | None = None,
) -> Path:
    """Write the page of such a clip; ``sound`` is a file whose sound it has."""
    wall = texture(INFO.height, INFO.width, 3)
    with Outputs() as outputs:
        history = ObjectHistory(INFO, thumbnails=True)
        report = ReportSink(path, name, INFO, history, outputs, sound)
        for scene in scenes(movers, frames):
            image = np.roll(wall, scene.frame, axis=1) if pictures else None
            history.add(scene, image)
            report.add(scene, image)
        history.finish()
        report.finish()
    return path


def history_of(
    info: VideoInfo, frame: np.ndarray, number: np.ndarray, rng: np.random.Generator
) -> ObjectHistory:
    """A history whose table has these rows, its measures made up."""
    history = ObjectHistory(info)
    rows = len(frame)
    left, top = rng.uniform(0, 600, (2, rows)).astype(np.float32)
    side = np.full(rows, 50, np.float32)
    some = rng.uniform(0.1, 9, rows).astype(np.float32)
    history.table = ObjectTable(
        frame.astype(np.int32),
        frame / float(info.fps),
        number.astype(np.int32),
        np.full(rows, 20, np.int32),
        left,
        top,
        side,
        side,
        left + 25,
        top + 25,
        some,
        some,
        some,
        some,
        np.ones(rows, np.float32),
    )
    return history
