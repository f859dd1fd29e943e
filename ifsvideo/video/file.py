"""Video files, decoded by ffmpeg."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.errors import IfsVideoError, InputError, UsageError
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import ffmpeg
from ifsvideo.video.picture import Picture
from ifsvideo.video.probe import VIDEO_STREAM, Probe, probe
from ifsvideo.video.source import FrameSource, choose_stretch

_SEEK_FROM_S = 10.0
"""Start, seconds, from which on it pays to look for a key frame instead of decoding all before."""
_SEEK_MARGIN_S = 3.0
"""How much earlier the key frame is looked for: files are ordered by time of decoding, ahead of showing."""
_RGB = ",format=rgb24"
_PLANES = {False: ":out_color_matrix=bt601:out_range=tv,format=yuv420p", True: ":out_range=tv,format=yuv420p"}
"""As `Picture` has them, of BT.709 or not; nothing is computed where the file has them already."""
_ORIGIN = re.compile(r"^(\[[^\]]*\] )+")  # "[h264 @ 0x5632632572c0] ", which differs from run to run


class VideoFile(FrameSource):
    """Any file that ffmpeg decodes; its first video stream, upright, at a constant rate.

    A file of constant rate yields the frames that are decoded, none repeated and none left out. A variable
    rate is brought to the nominal constant one (ffmpeg's r_frame_rate) from time 0 on, each frame shown as
    long as it was.

    Parameters
    ----------
    path : Path
    fps : Fraction, optional
        Take the decoded frames one by one as if they had this rate, whatever their own times; then the
        sound is out of step and is not offered (``info.has_audio`` is False).
    start, end : float
        Stretch that is read, seconds; see `choose_stretch`.

    Raises
    ------
    InputError
        If the file cannot be read; before any frame is asked for.
    UsageError
        If the stretch makes no sense.
    """

    def __init__(
        self, path: Path, *, fps: Fraction | None = None, start: float = 0.0, end: float | None = None
    ) -> None:
        self.path = path
        self._child: ffmpeg.Ffmpeg | None = None
        found = probe(path)
        self._bt709 = found.bt709
        self._timing = _timing(found, fps)
        rate, zero = self._timing.fps, self._timing.zero
        self._stretch = choose_stretch(path, rate, zero, self._timing.frames, start, end)
        self.info = VideoInfo(
            width=found.width,
            height=found.height,
            fps=rate,
            frames=self._stretch.frames,
            sample_aspect=found.sample_aspect,
            has_audio=found.audio_codec is not None and fps is None,
            start=zero + float(self._stretch.first / rate),
        )

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`."""
        info = self.info
        yield from self._decode(_RGB, (info.height, info.width, 3))

    def pictures(self) -> Generator[Picture, None, None]:
        """See `FrameSource.pictures`."""
        width, height = self.info.width, self.info.height
        if width % 2 or height % 2:  # half a row of colours cannot be told from a whole one
            yield from super().pictures()
            return
        planes = self._decode(_PLANES[self._bt709], (height * 3 // 2, width))
        with closing(planes):
            for pixels in planes:
                yield Picture(pixels, self._bt709)

    def stop(self) -> None:
        """See `FrameSource.stop`."""
        if self._child is not None:
            self._child.kill()

    def _decode(self, form: str, shape: tuple[int, ...]) -> Generator[Image, None, None]:
        """Frames of the stretch as arrays of a shape, in one of the forms below."""
        first, stop = self._stretch.first, self._stretch.stop
        place = first if self._seeks else 0
        with ffmpeg.Ffmpeg(self._arguments(form)) as child:
            self._child = child
            while stop is None or place < stop:
                image = _read(child, shape)
                if image is None:
                    self._check_end(child, place)
                    break
                place += 1
                if place > first:
                    yield image
            child.stop()  # where the stretch ends before the file does
            self.warnings = self._judge(child.printed(), place - first)

    @property
    def _seeks(self) -> bool:
        return self._timing.exact_seek and self.info.start >= _SEEK_FROM_S

    def _arguments(self, form: str = _RGB) -> list[str]:
        # The size is forced, and the filters are not made anew, for files that change their size on the way.
        filters = [f"scale={self.info.width}:{self.info.height}{form}"]
        seek = []
        if not self._timing.constant:
            filters.insert(0, f"fps={self.info.fps}:start_time=0")
        elif self._seeks:
            seek = ["-ss", f"{self.info.start - _SEEK_MARGIN_S:.6f}", "-copyts", "-start_at_zero"]
            filters.insert(0, f"trim=start={self.info.start - 0.5 / float(self.info.fps):.6f}")
        return [
            *("-loglevel", "error", "-threads", "2", "-reinit_filter", "0", *seek),
            *("-i", ffmpeg.file_url(self.path), "-map", VIDEO_STREAM),
            *("-vf", ",".join(filters), "-fps_mode", "passthrough", "-f", "rawvideo", "-"),
        ]

    def _check_end(self, child: ffmpeg.Ffmpeg, place: int) -> None:
        """Tell an end of the file from a failure; ``place`` frames were decoded or passed over."""
        status = child.wait()
        if status < 0:
            raise IfsVideoError(
                f"{self.path}: ffmpeg was killed while reading (signal {-status}); run it again"
            )
        if place > self._stretch.first:
            return
        if place and not self._seeks:
            length = self._timing.zero + float(place / self.info.fps)
            raise UsageError(f"{self.path}: start is past the end; only {length:.2f} s can be decoded")
        reason = _ORIGIN.sub("", (child.printed() or ["no reason given"])[-1])
        raise InputError(f"{self.path}: no frame can be decoded; copy it again (ffmpeg: {reason})")

    def _judge(self, printed: list[str], frames: int) -> tuple[str, ...]:
        """Warnings after a full pass."""
        promised = self._stretch.frames
        reason = f" (ffmpeg: {_ORIGIN.sub('', printed[0])})" if printed else ""
        if promised is not None and frames < promised:
            return (f"{self.path}: only {frames} of {promised} frames could be decoded{reason}",)
        if not printed or self._seeks:  # a decoder that begins in the middle complains of what it missed
            return ()
        return (f"{self.path}: is damaged in places{reason}",)


def _read(child: ffmpeg.Ffmpeg, shape: tuple[int, ...]) -> Image | None:
    """The next frame of a raw video, None at its end."""
    image = np.empty(shape, dtype=np.uint8)
    got = child.stdout.readinto(image.data.cast("B"))
    return image if got == image.nbytes else None


@dataclass(frozen=True)
class _Timing:
    """How frames get their times: rate, time of the first, number; taken one by one or not; found or not."""

    fps: Fraction
    zero: float
    frames: int | None
    constant: bool
    exact_seek: bool


def _timing(found: Probe, fps: Fraction | None) -> _Timing:
    if fps is not None:
        return _Timing(fps, 0.0, found.packets or None, constant=True, exact_seek=False)
    return _Timing(found.fps, found.first, found.frames, found.constant, found.exact_seek)
