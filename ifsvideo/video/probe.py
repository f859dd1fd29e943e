"""What a file holds, found by letting ffmpeg decode its first frame and list its packets.

There is no ffprobe. The ``framecrc`` format tells the size, the pixel aspect and the rate exactly, after
rotation; the text that ffmpeg prints is read only for the container, the sound and the reason of a failure.
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

VIDEO_STREAM = "0:V:0"
"""The first video stream; the capital V passes over the cover picture of a song."""
_CONTAINER = re.compile(r"Input #0, ([\w,]+), from")
_BT709 = re.compile(r"Video: rawvideo.* yuv\w+\((?:\w+, )?bt709[,/)]")
"""ffmpeg's line on what it decoded: the matrix stands first of those that it names."""
_AUDIO = re.compile(r"Stream #0:\d+(?:\[0x[0-9a-f]+\])?(?:\(\w*\))?: Audio: (?!none)(\w+)")
_HIGHEST_PLAIN_RATE = 240
"""Frames per second above which a nominal rate is doubted: often it is but the clock's (1000, 90000)."""
_KEY = 1  # AV_PKT_FLAG_KEY
_DISCARD = 4  # AV_PKT_FLAG_DISCARD: decoded for reference only, as before the first frame of an edit list
_UNKNOWN_TIME = np.iinfo(np.int64).min  # AV_NOPTS_VALUE


@dataclass(frozen=True)
class Packets:
    """The video packets of a file.

    Attributes
    ----------
    times : (N,) float64
        Seconds from the start of the file, in order of showing.
    keys : (K,) float64
        Those of the key frames among them.
    exact : bool
        Whether these are times of showing; else of decoding, as in AVI.
    end : float
        When the last one has been shown, seconds; of a file that is cut off, what its header says.
    cut_off : bool
        Whether the file ends before its header says.
    """

    times: Floats
    keys: Floats
    exact: bool
    end: float
    cut_off: bool


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
        Time of the first frame, seconds from the start of the file (of its sound, where that begins earlier);
        0 for a variable rate, whose first frame is shown from there on.
    frames : int or None
        Frames that the packets promise at ``fps``; None where they could not be listed.
    packets : int
        Number of packets.
    exact_seek : bool
        Whether a frame can be found by its time without decoding all before it.
    bt709 : bool
        Whether it says that its luma and colours are those of Rec. ITU-R BT.709, not BT.601.
    audio_codec : str or None
        ffmpeg's name of the first sound stream's codec.
    """

    width: int
    height: int
    sample_aspect: Fraction
    fps: Fraction
    constant: bool
    first: float
    frames: int | None
    packets: int
    exact_seek: bool
    bt709: bool
    audio_codec: str | None


def probe(path: Path) -> Probe:
    """Find out what a video file holds.

    Raises
    ------
    InputError
        If the file is missing, not readable, empty, no video, or if not one frame of it can be decoded.
    """
    _check_readable(path)
    source = ["-i", ffmpeg.file_url(path), "-map", VIDEO_STREAM]
    _, listing, printed = ffmpeg.run([*source, "-frames:v", "1", "-f", "framecrc", "-"])
    properties = dict(re.findall(r"^#(\w+) 0: (.+)$", listing, re.MULTILINE))
    if "dimensions" not in properties or not re.search(r"^0,", listing, re.MULTILINE):
        raise InputError(f"{path}: {_reason(printed)}")
    width, height = (int(side) for side in properties["dimensions"].split("x"))
    packets = _list_packets(source)
    fps = _plausible(1 / Fraction(properties["tb"]), packets.times)
    constant = _is_constant(packets.times, fps)
    first = max(0.0, float(packets.times[0])) if constant and len(packets.times) else 0.0
    containers = _first_match(_CONTAINER, printed) or ""
    return Probe(
        width=width,
        height=height,
        sample_aspect=_aspect(properties.get("sar", "")),
        fps=fps,
        constant=constant,
        first=first,
        frames=_promised(packets, fps, first, constant),
        packets=len(packets.times),
        exact_seek=constant and packets.exact and re.search(r"\b(mp4|matroska)\b", containers) is not None,
        bt709=any(_BT709.search(line) for line in printed),
        audio_codec=_first_match(_AUDIO, printed),
    )


def count_frames(path: Path) -> int:
    """Number of video packets in a file, 0 where it cannot be read."""
    return len(_list_packets(["-i", ffmpeg.file_url(path), "-map", VIDEO_STREAM]).times)


def key_frames(path: Path) -> Floats:
    """Times (K,) of the key frames, seconds from the start of the file; none where it cannot be read."""
    return _list_packets(["-i", ffmpeg.file_url(path), "-map", VIDEO_STREAM]).keys


def audio_codec(path: Path) -> str | None:
    """ffmpeg's name of the codec of the first sound stream, None where there is none."""
    _, _, printed = ffmpeg.run(["-i", ffmpeg.file_url(path)])
    return _first_match(_AUDIO, printed)


def _check_readable(path: Path) -> None:
    """Name the faults that the system tells more clearly than ffmpeg does."""
    try:
        with path.open("rb") as file:
            if not file.read(1):
                raise InputError(f"{path}: is empty; copy or download it again")
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist; check the name") from None
    except PermissionError:
        raise InputError(f"{path}: no permission to read it; change its mode or its owner") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the name and the disk") from None


def _reason(printed: list[str]) -> str:
    """Why ffmpeg gave no frame, and what to do."""
    text = "\n".join(printed)
    if "moov atom not found" in text and "low score" not in text:
        return "is cut off (its index, the moov atom, is missing); copy or download it again"
    if re.search(r"matches no streams|Failed to set value '0:V:0'", text):
        return "holds no video" + (", only sound" if "Audio:" in text else "") + "; name a video file"
    if "Invalid data found when processing input" in text and "Stream #0" not in text:
        return "is not a video that ffmpeg can read; check that it is one, or copy it again"
    last = printed[-1] if printed else "no reason given"
    return f"not one frame can be decoded; convert it or copy it again (ffmpeg: {last})"


def _list_packets(source: list[str]) -> Packets:
    """The video packets of a file, read but not decoded."""
    _, listing, printed = ffmpeg.run([*source, "-c", "copy", "-f", "framecrc", "-"])
    base = re.search(r"^#tb 0: (\d+/\d+)$", listing, re.MULTILINE)
    rows = [line.split(",") for line in listing.splitlines() if line.startswith("0,")]
    rows = [row for row in rows if len(row) >= 6 and not _flags(row) & _DISCARD]
    if base is None or not rows:
        return Packets(np.zeros(0), np.zeros(0), exact=False, end=0.0, cut_off=False)
    tick = float(Fraction(base[1]))
    decoding, showing = (np.array([int(row[column]) for row in rows], dtype=np.int64) for column in (1, 2))
    exact = bool((showing != _UNKNOWN_TIME).all())
    clock = (showing if exact else decoding) * tick
    times, keys = np.sort(clock), np.sort(clock[[_flags(row) & _KEY != 0 for row in rows]])
    end = float(times[-1]) + int(rows[-1][3]) * tick
    cut_off = any(re.search(r"partial file|ended prematurely", line) for line in printed)
    return Packets(times, keys, exact, max(end, _duration(printed)) if cut_off else end, cut_off)


def _duration(printed: list[str]) -> float:
    """What the header says, seconds; 0 where it says nothing."""
    clock = _first_match(re.compile(r"Duration: (\d+:\d\d:\d\d\.\d+)"), printed)
    hours, minutes, seconds = (float(part) for part in (clock or "0:0:0").split(":"))
    return 3600 * hours + 60 * minutes + seconds


def _flags(row: list[str]) -> int:
    """A packet's flags; framecrc leaves them out where a packet is a key frame and nothing else."""
    return next((int(cell.split("=")[1], 16) for cell in row[6:] if cell.strip().startswith("F=")), _KEY)


def _plausible(nominal: Fraction, times: Floats) -> Fraction:
    """The nominal rate, or the average one where the nominal is but the resolution of a clock."""
    if nominal <= _HIGHEST_PLAIN_RATE or len(times) < 2 or times[-1] <= times[0]:
        return nominal
    average = (len(times) - 1) / float(times[-1] - times[0])
    return nominal if average > 0.7 * nominal else Fraction(round(average * 1000), 1000)


def _is_constant(times: Floats, fps: Fraction) -> bool:
    """Whether frame k is shown at ``times[0] + k / fps``.

    Clocks of a millisecond or of 1/90000 s shake the times by far less than the 3/4 of a frame allowed
    here, while a frame that is left out, or a rate that is not quite the nominal one, moves all that follow
    by a whole one.
    """
    places = (times - times[:1]) * float(fps)
    return bool((np.abs(places - np.arange(len(places))) < 0.75).all())


def _promised(packets: Packets, fps: Fraction, first: float, constant: bool) -> int | None:
    """Frames from ``first`` to the end at ``fps``."""
    if not len(packets.times):
        return None
    if constant and not packets.cut_off:
        return len(packets.times)
    return max(1, round((packets.end - first) * fps))


def _aspect(text: str) -> Fraction:
    width, _, height = text.partition("/")
    if width.isdigit() and height.isdigit() and int(width) and int(height):
        return Fraction(int(width), int(height))
    return Fraction(1)


def _first_match(pattern: re.Pattern[str], lines: list[str]) -> str | None:
    return next((match[1] for line in lines if (match := pattern.match(line))), None)
