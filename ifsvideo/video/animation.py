"""Animated GIF and WebP, written through ffmpeg, made small enough where a size is told.

Pictures are first kept without loss in a hidden file, since colours are chosen from all of them and a size is
known only when all is written. To keep a size, three things are given up, one after the other, each as far as
need be. Of a GIF: pictures a second (down to `LEAST_RATE`), width (down to `LEAST_WIDTH` pixels), colours
(256 to 64). Of a WebP: quality (80 to 50), pictures a second, width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import VideoInfo
from ifsvideo.video import ffmpeg
from ifsvideo.video.feeding import FedWriter

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


class AnimationWriter(FedWriter):
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
        super().__init__(path, info, outputs, transparent)
        self._max_bytes = max_bytes
        self._gif = path.suffix.lower() == ".gif"

    def _arguments(self) -> list[str]:
        """Keep the frames as they are."""
        self._kept = self._own.add_scratch(self._target.with_suffix(".mkv"))
        self._palette = self._own.add_scratch(self._target.with_suffix(".png"))
        given, kept = ("rgba", "bgra") if self._transparent else ("rgb24", "bgr0")
        return [
            *self._input(self._info.width, self._info.height, given),
            *("-c:v", "ffv1", "-level", "3", "-pix_fmt", kept),
            *("-f", "matroska", "-y", ffmpeg.file_url(self._kept)),
        ]

    def _complete(self) -> None:
        """Write the animation, as often as its size asks for."""
        rung, given_up = self._fitting()
        if given_up:
            rate = f"{float(self._info.fps / rung.every):.4g} pictures a second"
            level = f"{_COLOURS[rung.level]} colours" if self._gif else f"quality {_QUALITY[rung.level]}"
            allowed = f"{(self._max_bytes or 0) / 1e6:g} MB"
            self._warn(f"{rung.width}x{rung.height}, {rate}, {level}, to keep {allowed}")

    def _fitting(self) -> tuple[Rung, bool]:
        """Write it the best way that keeps the size; which, and whether something was given up for it."""
        rungs = ladder(self._info.width, self._info.height, self._info.fps, gif=self._gif)
        given_up = False
        while True:
            rung = rungs.pop(0)
            self._encode(rung)
            size = self._target.stat().st_size
            if self._max_bytes is None or size <= self._max_bytes:
                return rung, given_up
            if not rungs:
                break
            # What is hopeless by its number of pixels is not tried, but for the last.
            hope = _HOPE * self._max_bytes / size * rung.weight
            rungs = [other for other in rungs[:-1] if other.weight <= hope] + rungs[-1:]
            given_up = True
        raise OutputError(
            f"{self.path}: takes {size / 1e6:.2f} MB even at its smallest, more than the "
            f"{self._max_bytes / 1e6:g} MB allowed; show a shorter stretch (--start, --end) or allow more"
        )

    def _encode(self, rung: Rung) -> None:
        sized = f"framestep={rung.every},scale={rung.width}:{self._upright(rung)}:flags=lanczos,setsar=1"
        if self._gif:
            self._encode_gif(sized, _COLOURS[rung.level])
        else:
            self._encode_webp(sized, _QUALITY[rung.level])

    def _encode_gif(self, sized: str, colours: int) -> None:
        """Choose the colours out of all pictures, then write with them.

        The pattern of an ordered dither stays where it is from picture to picture; error diffusion swarms.
        """
        source, palette = ffmpeg.file_url(self._kept), ffmpeg.file_url(self._palette)
        choice = f"palettegen=max_colors={colours}:reserve_transparent={int(self._transparent)}"
        still = ("-f", "image2", "-update", "1", "-y", palette)
        self._run(["-i", source, "-vf", f"{sized},{choice}", *still])
        use = "paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"
        graph = f"[0:v]{sized}[pictures];[pictures][1:v]{use}"
        self._run(["-i", source, "-i", palette, "-lavfi", graph, "-f", "gif", *self._for_ever()])

    def _encode_webp(self, sized: str, quality: int) -> None:
        pixels = "yuva420p" if self._transparent else "yuv420p"
        encoder = ("-c:v", "libwebp_anim", "-quality", str(quality), "-compression_level", "4")
        source = ("-i", ffmpeg.file_url(self._kept), "-vf", f"{sized},format={pixels}")
        self._run([*source, *encoder, "-f", "webp", *self._for_ever()])

    def _for_ever(self) -> list[str]:
        """Arguments for the target, which begins anew when it has ended."""
        return ["-loop", "0", "-y", ffmpeg.file_url(self._target)]

    def _upright(self, rung: Rung) -> int:
        """Height in square pixels, which neither format knows otherwise."""
        return max(1, round(rung.height / self._info.sample_aspect))

    def _run(self, arguments: list[str]) -> None:
        status, _, complaints = ffmpeg.run(["-loglevel", "error", *arguments])
        if status != 0:
            raise self._failure(complaints)
