"""What a file holds, found by letting ffmpeg decode its first frame and list its packets.

There is no ffprobe. The ``framecrc`` format tells the size, the pixel aspect and the rate exactly, after rotation; the
text that ffmpeg prints is read only for the sound and for the reason of a failure.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.errors import InputError
from ifsvideo.types import Floats
from ifsvideo.video import ffmpeg

_AUDIO = re.compile(r"Stream #0:\d+(?:\[0x[0-9a-f]+\])?(?:\(\w*\))?: Audio: (\w+)")
_VIDEO_STREAM = "0:V:0"  # capital V: not the cover picture of a song
_HIGHEST_PLAIN_RATE = 240
"""Frames per second above which a nominal rate is doubted: often it is only the resolution of the clock (1000, 90000)."""
_DISCARD = 4  # AV_PKT_FLAG_DISCARD: decoded for reference only, as before the first frame of an edit list


@dataclass(frozen=True)
class Probe:
    """What is known of a video file before it is decoded.

    Attributes
    ----------
    width, height : int
        Size of the upright picture, pixels.
    sample_aspect : Fraction
        Of the upright picture; 1 where the file says nothing.
    fps : Fraction
        Nominal constant rate.
    constant : bool
        Whether the frames stand on the grid of ``fps``, one on each place.
    first : float
        Time of the first frame, seconds from the start of the file (of its sound, where that begins earlier).
    frames : int
        Frames that the packets promise at ``fps``.
    packets : int
        Frames that the packets promise one by one.
    audio_codec : str or None
        ffmpeg's name of the first sound stream's codec.
    """

    width: int
    height: int
    sample_aspect: Fraction
    fps: Fraction
    constant: bool
    first: float
    frames: int
    packets: int
    audio_codec: str | None


def probe(path: Path) -> Probe:
    """Find out what a video file holds.

    Raises
    ------
    InputError
        If the file is missing, not readable, empty, no video, or if not one frame of it can be decoded.
    """
    _check_readable(path)
    source = ["-i", ffmpeg.file_url(path), "-map", _VIDEO_STREAM]
    status, listing, complaints = ffmpeg.run([*source, "-frames:v", "1", "-f", "framecrc", "-"])
    properties = dict(re.findall(r"^#(\w+) 0: (.+)$", listing, re.MULTILINE))
    if not re.search(r"^0,", listing, re.MULTILINE) or "dimensions" not in properties:
        raise InputError(f"{path}: {_reason(complaints)}" + (f" (ffmpeg: {status})" if status < 0 else ""))
    width, height = (int(side) for side in properties["dimensions"].split("x"))
    times, duration = _packet_times(source)
    fps = _plausible(1 / Fraction(properties["tb"]), times)
    places = (times - times[:1]) * float(fps)
    # Clocks of a millisecond or of 1/90000 s shake a constant rate by far less than a frame, and never add up.
    constant = bool((np.abs(places - np.arange(len(places))) < 0.75).all())
    span = float(times[-1]) + duration if len(times) else 0.0
    return Probe(
        width=width,
        height=height,
        sample_aspect=_aspect(properties.get("sar", "")),
        fps=fps,
        constant=constant,
        first=max(0.0, float(times[0])) if constant and len(times) else 0.0,
        frames=len(times) if constant else max(1, round(span * fps)),
        packets=len(times),
        audio_codec=next((match[1] for line in complaints if (match := _AUDIO.match(line))), None),
    )


def count_frames(path: Path) -> int:
    """Number of video packets in a file, 0 where it cannot be read."""
    return len(_packet_times(["-i", ffmpeg.file_url(path), "-map", _VIDEO_STREAM])[0])


def audio_codec(path: Path) -> str | None:
    """ffmpeg's name of the codec of the first sound stream, None where there is none."""
    _, _, complaints = ffmpeg.run(["-i", ffmpeg.file_url(path)])
    return next((match[1] for line in complaints if (match := _AUDIO.match(line))), None)


def _check_readable(path: Path) -> None:
    """Faults that the system tells more clearly than ffmpeg does."""
    try:
        with path.open("rb") as file:
            if not file.read(1):
                raise InputError(f"{path}: is empty; copy or download it again")
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist; check the name") from None
    except PermissionError:
        raise InputError(f"{path}: no permission to read it; change its mode or its owner") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk") from None


def _reason(complaints: list[str]) -> str:
    """Why ffmpeg gave no frame, and what to do."""
    text = "\n".join(complaints)
    if "moov atom not found" in text and "low score" not in text:
        return "is cut off (its index, the moov atom, is missing); copy or download it again"
    if re.search(r"matches no streams|Failed to set value '0:V:0'", text):
        return "holds no video" + (", only sound" if "Audio:" in text else "") + "; name a video file"
    if "Invalid data found when processing input" in text and "Stream #0" not in text:
        return "is not a video that ffmpeg can read; check that it is one, or copy it again"
    last = complaints[-1] if complaints else "no reason given"
    return f"not one frame can be decoded; convert it or copy it again (ffmpeg: {last})"


def _packet_times(source: list[str]) -> tuple[Floats, float]:
    """Times of the video packets in order of showing (N,), seconds, and the length of the last; nothing is decoded."""
    _, listing, _ = ffmpeg.run([*source, "-c", "copy", "-f", "framecrc", "-"])
    base = re.search(r"^#tb 0: (\d+)/(\d+)$", listing, re.MULTILINE)
    rows = [line.split(",") for line in listing.splitlines() if line.startswith("0,")]
    rows = [row for row in rows if len(row) >= 6 and not _discarded(row)]
    if base is None or not rows:
        return np.zeros(0), 0.0
    tick = int(base[1]) / int(base[2])
    decoding, showing = (np.array([int(row[column]) for row in rows], dtype=np.int64) for column in (1, 2))
    unknown = np.iinfo(np.int64).min
    stamps = np.sort(decoding if (showing == unknown).any() else showing)  # AVI knows no time of showing
    return stamps * tick, int(rows[-1][3]) * tick


def _discarded(row: list[str]) -> bool:
    flags = next((int(cell.split("=")[1], 16) for cell in row[6:] if cell.strip().startswith("F=")), 0)
    return bool(flags & _DISCARD)


def _plausible(nominal: Fraction, times: Floats) -> Fraction:
    """The nominal rate, or the average one where the nominal is but the resolution of a clock."""
    if nominal <= _HIGHEST_PLAIN_RATE or len(times) < 2 or times[-1] <= times[0]:
        return nominal
    average = (len(times) - 1) / float(times[-1] - times[0])
    return nominal if average > 0.7 * nominal else Fraction(round(average * 1000), 1000)


def _aspect(text: str) -> Fraction:
    width, _, height = text.partition("/")
    if width.isdigit() and height.isdigit() and int(width) and int(height):
        return Fraction(int(width), int(height))
    return Fraction(1)
