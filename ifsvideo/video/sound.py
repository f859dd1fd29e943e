"""The sound of a recording that was cut into files: one stretch of each, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ifsvideo.video import ffmpeg

_RATE = 48_000


@dataclass(frozen=True)
class Stretch:
    """What is heard while the pictures of one file are shown.

    Attributes
    ----------
    path : Path or None
        None is silence.
    start, seconds : float
        Where in the file it begins, and its length.
    """

    path: Path | None
    start: float
    seconds: float


@dataclass(frozen=True)
class JoinedSound:
    """Stretches, one after the other; each as long as its pictures, so that none moves those behind it."""

    stretches: tuple[Stretch, ...]

    def arguments(self, stream: int) -> list[str]:
        """What tells ffmpeg to make it, as ``[sound]``, of its inputs from number ``stream`` on."""
        inputs: list[str] = []
        chains: list[str] = []
        for k, stretch in enumerate(self.stretches):
            length = f"{stretch.seconds:.6f}"
            if stretch.path is None:
                source = f"anullsrc=r={_RATE}:cl=stereo"
            else:
                inputs += ["-ss", f"{stretch.start:.6f}", "-vn", "-i", ffmpeg.file_url(stretch.path)]
                # What begins late, or has a hole, is filled; what is too short is made longer.
                source = f"[{stream}:a:0]aresample={_RATE}:async=1:first_pts=0,"
                source += f"aformat=channel_layouts=stereo,apad=whole_dur={length}"
                stream += 1
            chains.append(f"{source},atrim=end={length},asetpts=N/SR/TB[part{k}]")
        parts = "".join(f"[part{k}]" for k in range(len(chains)))
        chains.append(f"{parts}concat=n={len(self.stretches)}:v=0:a=1[sound]")
        return [*inputs, "-filter_complex", ";".join(chains)]


SoundSource = Path | JoinedSound
"""A file whose first sound stream is taken, or what several files were cut into."""
