"""H.264 files that play in a browser, written through ffmpeg and placed when complete."""

from __future__ import annotations

import math
import os
from collections.abc import Collection
from pathlib import Path

import numpy as np

from ifsvideo.errors import UsageError
from ifsvideo.output.atomic import Outputs, check_writable
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import animation, ffmpeg
from ifsvideo.video.feeding import FedWriter
from ifsvideo.video.picture import planes_of
from ifsvideo.video.probe import audio_codec, count_frames
from ifsvideo.video.sound import JoinedSound, SoundSource

FORMATS = {".mp4": "mp4", ".mov": "mov", ".mkv": "matroska"}
"""Output endings and ffmpeg's name of the container."""
_COPIED_SOUND = {
    ".mp4": {"aac", "mp3", "opus"},
    ".mov": {"aac", "mp3", "alac", "pcm_s16le", "pcm_s24le"},
    ".mkv": {"aac", "mp3", "opus", "vorbis", "flac", "ac3", "eac3", "pcm_s16le"},
}
"""Codecs that the container holds and common players play; other sound is encoded again, as AAC."""
_ENCODER = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-threads", "2"]
_ENCODER_FOR_PAGES = ["-c:v", "libx264", "-preset", "superfast", "-crf", "27", "-g", "15", "-threads", "2"]
# One matrix for every size, and the tags that say so: players guess by the size where tags are missing.
_COLOURS = "setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709"


def check_output(
    path: Path, source: Path | None = None, endings: Collection[str] = (*FORMATS, *animation.ENDINGS)
) -> None:
    """Refuse an output before any work is done.

    Parameters
    ----------
    path : Path
        Video or animation to be written.
    source : Path, optional
        Input, which must be another file (also by another name of it).
    endings : collection of str
        Those that are known.

    Raises
    ------
    UsageError
        If the ending is another, or the output is the input.
    OutputError
        If nothing can be written there.
    """
    if path.suffix.lower() not in endings:
        raise UsageError(f"{path}: unknown ending {path.suffix!r}; name an output in {', '.join(endings)}")
    if source is not None and path.exists() and source.exists() and os.path.samefile(path, source):
        raise UsageError(f"{path}: is the input itself; name another output")
    check_writable(path)


class VideoWriter(FedWriter):
    """Writes frames to an H.264 file: yuv420p, constant rate, faststart.

    With transparency, which H.264 does not know, the codec is QuickTime Animation, which programs that cut
    films read; it loses nothing.

    The file appears at its place when the context ends well; otherwise nothing is left, an older file stays.

    Parameters
    ----------
    path : Path
        .mp4, .mov or .mkv.
    info : VideoInfo
        Size, rate and pixel aspect of the frames; ``info.start`` is where in ``audio_from`` the sound begins.
    audio_from : path or JoinedSound, optional
        Whose first sound stream is kept, for as long as the video is: copied where it is taken from a file's
        beginning and the container holds its codec, else encoded as AAC, cut to the sample.
    outputs : Outputs, optional
        Group with which the file is placed; alone by default.
    transparent : bool
        Whether the frames are RGBA; .mov only.
    for_page : bool
        Whether it is small rather than fine, and can be entered at every half second or so.

    Attributes
    ----------
    warnings : tuple of str
        What a user should know; complete after the context has ended.
    frames : int
        Frames written so far.

    Raises
    ------
    UsageError, OutputError
        As `check_output`; `OutputError` also if ffmpeg fails, the disk is full or no frame was written.

    Examples
    --------
    ::

        with VideoWriter(Path("out.mp4"), source.info, audio_from=source.path) as writer:
            for image in frames:
                writer.write(image)
    """

    def __init__(
        self,
        path: Path,
        info: VideoInfo,
        *,
        audio_from: SoundSource | None = None,
        outputs: Outputs | None = None,
        transparent: bool = False,
        for_page: bool = False,
    ) -> None:
        check_output(path, endings=[".mov"] if transparent else FORMATS)
        super().__init__(path, info, outputs, transparent)
        self._audio_from = audio_from
        self._encoder = _ENCODER_FOR_PAGES if for_page else _ENCODER
        self._pad = (0, 0) if transparent else (info.height % 2, info.width % 2)
        if any(self._pad):
            width, height = info.width + self._pad[1], info.height + self._pad[0]
            self._warn(f"padded by one pixel to {width}x{height}: H.264 needs even sides")

    @property
    def padded(self) -> bool:
        """Whether an odd side is padded by one pixel (a repetition of the last row or column)."""
        return any(self._pad)

    def _as_fed(self, image: Image) -> Image:
        if self._transparent:
            return super()._as_fed(image)
        if self.padded:
            image = np.pad(image, ((0, self._pad[0]), (0, self._pad[1]), (0, 0)), mode="edge")
        return planes_of(super()._as_fed(image))

    def _complete(self) -> None:
        """Add the sound, make sure that all is there."""
        if self._audio_from is not None:
            self._add_sound(self._audio_from)
        placed = count_frames(self._target)
        if placed != self.frames:  # a full disk does not always make ffmpeg fail
            raise self._failure([*self._child.printed(), f"{placed} of {self.frames} frames arrived"])

    def _arguments(self) -> list[str]:
        # With sound, the pictures go to a file of their own first: the length is known only at the end.
        self._pictures = self._own.add_scratch(self._target) if self._audio_from else self._target
        filters = f"setsar=sar={self._info.sample_aspect}:max=65535"
        pixels, encoder = "rgba", ["-c:v", "qtrle", "-pix_fmt", "argb"]
        if not self._transparent:
            pixels, filters, encoder = "yuv420p", f"{_COLOURS},{filters}", self._encoder
        return [
            *self._input(self._info.width + self._pad[1], self._info.height + self._pad[0], pixels),
            *("-vf", filters, *encoder, "-fps_mode", "passthrough"),
            *self._destination(self._pictures),
        ]

    def _destination(self, file: Path) -> list[str]:
        container = FORMATS[self.path.suffix.lower()]
        faststart = [] if container == "matroska" else ["-movflags", "+faststart"]
        return [*faststart, "-f", container, "-y", ffmpeg.file_url(file)]

    def _add_sound(self, source: SoundSource) -> None:
        """Join pictures and sound; without sound, and with a warning, where the sound cannot be read."""
        complaints: list[str] = []
        for inputs, codec in self._attempts(source):
            complaints = self._join(inputs, codec)
            if not complaints:
                return
        self._warn("the sound could not be kept" + (f" (ffmpeg: {complaints[-1]})" if complaints else ""))
        os.replace(self._pictures, self._target)

    def _attempts(self, source: SoundSource) -> list[tuple[list[str], list[str]]]:
        """What ffmpeg reads, and what it makes of its sound; the way that loses least first."""
        encoded = ["-c:a", "aac", "-b:a", "160k"]
        if isinstance(source, JoinedSound):
            return [(source.arguments(1), ["-map", "[sound]", *encoded])]
        codec = audio_codec(source)
        if codec is None:
            return []
        whole = self._info.start < 0.5 / self._info.fps
        copied = whole and codec in _COPIED_SOUND[self.path.suffix.lower()]
        inputs = ["-ss", f"{self._info.start:.6f}", "-vn", "-i", ffmpeg.file_url(source)]
        codecs = [["-c:a", "copy"], encoded] if copied else [encoded]
        return [(inputs, ["-map", "1:a:0", *own]) for own in codecs]

    def _join(self, inputs: list[str], sound: list[str]) -> list[str]:
        """Write pictures and sound to the target; returns what ffmpeg complained of, if it failed."""
        length = math.ceil(1e6 * self.frames / self._info.fps)
        status, _, complaints = ffmpeg.run(
            [
                *("-loglevel", "error", "-i", ffmpeg.file_url(self._pictures), *inputs),
                *("-map", "0:v", *sound, "-c:v", "copy", "-t", f"{length}us"),
                *self._destination(self._target),
            ]
        )
        if "No space left on device" in "\n".join(complaints):
            raise self._failure(complaints)
        return [] if status == 0 else complaints or [f"exit status {status}"]
