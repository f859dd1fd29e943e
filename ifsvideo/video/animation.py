"""Animated GIF and WebP, written through ffmpeg, made small enough where a size is told.

Pictures are first kept without loss in a hidden file, since colours are chosen from all of them and a size is
known only when all is written. To keep a size, three things are given up, one after the other, each as far as
need be. Of a GIF: pictures a second (down to `LEAST_RATE`), width (down to `LEAST_WIDTH` pixels), colours
(256 to 64). Of a WebP: quality (80 to 50), pictures a second, width.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import ffmpeg

ENDINGS = {".gif": "gif", ".webp": "webp"}
"""Output endings and ffmpeg's name of the format."""
LEAST_RATE = 10
LEAST_WIDTH = 240
_GREATEST_RATE = 50
"""Of a GIF: browsers take a delay below 1/50 s for one of 1/10 s."""
_COLOURS = (256, 128, 64)
_QUALITY = (80, 65, 50)
_STEP = 0.92
"""Of the width: 0.85 of the area."""
_HOPE = 1.3
"""How much smaller a file may turn out than its number of pixels promises."""


@dataclass(frozen=True)
class Rung:
    """One way to write it: every ``every``-th picture, ``width`` x ``height`` pixels, colours or quality."""

    every: int
    width: int
    height: int
    level: int
    """Which of the numbers of colours, or qualities: 0 the best."""

    @property
    def weight(self) -> float:
        """Grows about as the file does."""
        return self.width * self.height / self.every / (1.0 + 0.3 * self.level)


def ladder(width: int, height: int, fps: Fraction, *, gif: bool) -> list[Rung]:
    """Ways to write an animation, the best first, in the order in which things are given up."""
    every = math.ceil(fps / _GREATEST_RATE) if gif else 1
    rungs = [Rung(every, width, height, 0)]
    for give_up in (_rate, _size, _level) if gif else (_level, _rate, _size):
        rungs += give_up(rungs[-1], fps, width, height)
    return rungs


def _rate(rung: Rung, fps: Fraction, width: int, height: int) -> list[Rung]:
    """Fewer and fewer pictures a second."""
    return [replace(rung, every=every) for every in range(rung.every + 1, int(fps / LEAST_RATE) + 1)]


def _size(rung: Rung, fps: Fraction, width: int, height: int) -> list[Rung]:
    """Smaller and smaller pictures."""
    steps = max(0, math.floor(math.log(LEAST_WIDTH / width, _STEP)))
    shares = [_STEP**step for step in range(1, steps + 1)]
    return [replace(rung, width=round(s * width), height=max(1, round(s * height))) for s in shares]


def _level(rung: Rung, fps: Fraction, width: int, height: int) -> list[Rung]:
    """Fewer and fewer colours, or worse and worse quality."""
    return [replace(rung, level=level) for level in range(1, len(_COLOURS))]


class AnimationWriter:
    """Writes frames to an animated GIF or WebP that plays for ever (as `ifsvideo.video.VideoWriter`).

    Parameters
    ----------
    path : Path
        .gif or .webp.
    info : VideoInfo
        Size and rate of the frames.
    outputs : Outputs, optional
        Group with which the file is placed; alone by default.
    transparent : bool
        Whether the frames are RGBA. A GIF knows only there and not there, a WebP all shades between.
    max_bytes : int, optional
        Size that is kept.

    Attributes
    ----------
    warnings : tuple of str
        What was given up to keep the size.
    frames : int
        Frames written so far.

    Raises
    ------
    OutputError
        If ffmpeg fails, the disk is full, no frame was written, or the size cannot be kept.
    """

    def __init__(
        self,
        path: Path,
        info: VideoInfo,
        *,
        outputs: Outputs | None = None,
        transparent: bool = False,
        max_bytes: int | None = None,
    ) -> None:
        self.path = path
        self.frames = 0
        self.warnings: tuple[str, ...] = ()
        self._info = info
        self._group = outputs
        self._channels = 4 if transparent else 3
        self._max_bytes = max_bytes
        self._gif = path.suffix.lower() == ".gif"

    def __enter__(self) -> Self:
        self._own = Outputs()
        self._complete = False
        try:
            self._target = (self._group or self._own).add(self.path)
            self._kept = self._own.add_scratch(self._target.with_suffix(".mkv"))
            self._palette = self._own.add_scratch(self._target.with_suffix(".png"))
            self._child = ffmpeg.Ffmpeg(self._keeping(), feeds=True)
        except BaseException:
            self._own.discard()
            raise
        return self

    def write(self, image: Image) -> None:
        """Append one frame, (H, W, 3) uint8 RGB, or (H, W, 4) RGBA where it is transparent."""
        expected = (self._info.height, self._info.width, self._channels)
        if image.shape != expected or image.dtype != np.uint8:
            raise ValueError(f"expected uint8 image of shape {expected}, got {image.dtype} {image.shape}")
        try:
            self._child.stdin.write(np.ascontiguousarray(image).data.cast("B"))
        except OSError:
            self._child.wait()
            raise self._failure(self._child.printed()) from None
        self.frames += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.finish()
        except BaseException as failure:
            kind, error, trace = type(failure), failure, failure.__traceback__
            raise
        finally:
            self._child.stop()
            self._own.__exit__(kind, error, trace)

    def finish(self) -> None:
        """Write the animation, as often as its size asks for; leaving the context well does it too.

        Raises
        ------
        OutputError
            See the class.
        """
        if self._complete:
            return
        with suppress(OSError):  # where ffmpeg has died, its exit status says more
            self._child.stdin.close()
        if self._child.wait() != 0:
            raise self._failure(self._child.printed())
        if self.frames == 0:
            raise OutputError(f"{self.path}: no frame was written; nothing is left to place there")
        self._tell(self._fitting())
        self._complete = True

    def _fitting(self) -> Rung:
        """Write it the best way that keeps the size."""
        rungs = ladder(self._info.width, self._info.height, self._info.fps, gif=self._gif)
        self._given_up = False
        while True:
            rung = rungs.pop(0)
            self._encode(rung)
            size = self._target.stat().st_size
            if self._max_bytes is None or size <= self._max_bytes:
                return rung
            if not rungs:
                break
            # What is hopeless by its number of pixels is not tried, but for the last.
            hope = _HOPE * self._max_bytes / size * rung.weight
            rungs = [other for other in rungs[:-1] if other.weight <= hope] + rungs[-1:]
            self._given_up = True
        raise OutputError(
            f"{self.path}: takes {size / 1e6:.2f} MB even at its smallest, more than the "
            f"{self._max_bytes / 1e6:g} MB allowed; show a shorter stretch (--start, --end) or allow more"
        )

    def _tell(self, rung: Rung) -> None:
        if self._given_up:
            rate = f"{float(self._info.fps / rung.every):.4g} pictures a second"
            level = f"{_COLOURS[rung.level]} colours" if self._gif else f"quality {_QUALITY[rung.level]}"
            allowed = f"{(self._max_bytes or 0) / 1e6:g} MB"
            self.warnings = (f"{self.path}: {rung.width}x{rung.height}, {rate}, {level}, to keep {allowed}",)

    def _keeping(self) -> list[str]:
        """Arguments of the ffmpeg that keeps the frames as they are."""
        info = self._info
        pixels = ("rgba", "bgra") if self._channels == 4 else ("rgb24", "bgr0")
        return [
            *("-loglevel", "error", "-f", "rawvideo", "-pix_fmt", pixels[0]),
            *("-video_size", f"{info.width}x{info.height}", "-framerate", str(info.fps), "-i", "pipe:0"),
            *("-c:v", "ffv1", "-level", "3", "-pix_fmt", pixels[1]),
            *("-f", "matroska", "-y", ffmpeg.file_url(self._kept)),
        ]

    def _encode(self, rung: Rung) -> None:
        source = ["-loglevel", "error", "-i", ffmpeg.file_url(self._kept)]
        sized = f"framestep={rung.every},scale={rung.width}:{self._upright(rung)}:flags=lanczos,setsar=1"
        target = ["-loop", "0", "-y", ffmpeg.file_url(self._target)]
        if not self._gif:
            quality = (
                "-c:v",
                "libwebp_anim",
                "-quality",
                str(_QUALITY[rung.level]),
                "-compression_level",
                "4",
            )
            pixels = "yuva420p" if self._channels == 4 else "yuv420p"
            self._run([*source, "-vf", f"{sized},format={pixels}", *quality, "-f", "webp", *target])
            return
        clear = int(self._channels == 4)
        count = f"max_colors={_COLOURS[rung.level]}:reserve_transparent={clear}:stats_mode=full"
        palette = ffmpeg.file_url(self._palette)
        self._run(
            [*source, "-vf", f"{sized},palettegen={count}", "-f", "image2", "-update", "1", "-y", palette]
        )
        use = "paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"
        graph = f"[0:v]{sized}[pictures];[pictures][1:v]{use}"
        self._run([*source, "-i", palette, "-lavfi", graph, "-f", "gif", *target])

    def _upright(self, rung: Rung) -> int:
        """Height in square pixels, which neither format knows otherwise."""
        return max(1, round(rung.height / self._info.sample_aspect))

    def _run(self, arguments: list[str]) -> None:
        status, _, complaints = ffmpeg.run(arguments)
        if status != 0:
            raise self._failure(complaints)

    def _failure(self, complaints: list[str]) -> OutputError:
        if "No space left on device" in "\n".join(complaints):
            return OutputError(f"{self.path}: the disk is full; free space or name another place")
        reason = complaints[-1] if complaints else "it was killed"
        return OutputError(f"{self.path}: ffmpeg could not write it ({reason}); check the disk and memory")
