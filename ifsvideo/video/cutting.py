"""Short pieces cut out of a video: copied where a key frame allows, else encoded anew."""

from __future__ import annotations

from pathlib import Path

from ifsvideo.errors import OutputError
from ifsvideo.types import Floats
from ifsvideo.video import ffmpeg
from ifsvideo.video.probe import VIDEO_STREAM, count_frames, key_frames
from ifsvideo.video.writer import FORMATS

_EARLY_S = 1.0
"""How much too early a piece may begin, seconds, to begin with a key frame and be copied as it is."""
_CLOCK_S = 0.001
"""By how much clocks may round, seconds: copying looks for a key frame as much later, to find it and not the
one before, encoding begins as much earlier, not to lose a frame."""
_EXACTLY = [
    "-fps_mode",
    "passthrough",
    "-c:v",
    "libx264",
    "-preset",
    "veryfast",
    "-crf",
    "20",
    "-pix_fmt",
    "yuv420p",
    "-threads",
    "2",
]
_SOUND = ["-c:a", "aac", "-b:a", "160k"]


class Cutter:
    """Cuts pieces out of one video.

    Parameters
    ----------
    source : Path

    Examples
    --------
    ::

        file = Cutter(Path("drive.mp4")).cut(12.0, 16.0, Path("folder/turn"))
    """

    def __init__(self, source: Path) -> None:
        self._source = source
        self._keys: Floats = key_frames(source)
        # Matroska holds whatever a codec is; mp4 and mov keep what came in one of them.
        ending = source.suffix.lower()
        self._ending = ending if ending in FORMATS else ".mkv"

    def cut(self, start: float, end: float, stem: Path) -> Path:
        """Write the piece from ``start`` to ``end``, seconds of the video; returns the file.

        Where a key frame lies at most a second before ``start``, pictures and sound are copied from there;
        elsewhere they are encoded anew, exactly from ``start``.

        Parameters
        ----------
        stem : Path
            Place and name without an ending, which the way of cutting decides.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        before = self._keys[(self._keys <= start + 1e-6) & (self._keys >= start - _EARLY_S)]
        if len(before):
            copied = stem.with_name(stem.name + self._ending)
            if not self._run(float(before[-1]) + _CLOCK_S, end, ["-c", "copy"], copied):
                return copied
            copied.unlink(missing_ok=True)
        encoded = stem.with_name(f"{stem.name}.mp4")
        complaints = self._run(start - _CLOCK_S, end - _CLOCK_S, [*_EXACTLY, *_SOUND], encoded)
        if complaints:
            raise OutputError(f"{stem.parent}: a piece of {self._source} could not be cut ({complaints[-1]})")
        return encoded

    def _run(self, start: float, end: float, codec: list[str], file: Path) -> list[str]:
        """Write a file; returns what ffmpeg complained of, if it failed."""
        # From the beginning on, nothing is looked for: in an AVI that fails.
        seek = ["-ss", f"{start:.6f}"] if start > _CLOCK_S else []
        fast = [] if file.suffix == ".mkv" else ["-movflags", "+faststart"]
        status, _, complaints = ffmpeg.run(
            [
                *("-loglevel", "error", *seek, "-i", ffmpeg.file_url(self._source)),
                *("-t", f"{end - start:.6f}", "-map", VIDEO_STREAM, "-map", "0:a:0?", *codec),
                *("-avoid_negative_ts", "make_zero", *fast, "-y", ffmpeg.file_url(file)),
            ]
        )
        if status == 0 and count_frames(file):
            return []
        return complaints or ["no frame was written"]
