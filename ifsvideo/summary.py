"""What a person wants to read when a run is done."""

from __future__ import annotations

from ifsvideo.output.legend import clock
from ifsvideo.types import Result

_SHOWN = 12
"""Objects, and events, listed one by one; the files have all."""


def summary(name: str, result: Result, seconds: float) -> str:
    """The summary of a run, lines without a final line break.

    Parameters
    ----------
    name : str
        What was read.
    result : Result
    seconds : float
        How long the run took, all in all.
    """
    lines = [_headline(name, result)]
    for item in result.objects[:_SHOWN]:
        lasting = f"{clock(item.first_s)} to {clock(item.last_s)}"
        lines.append(f"  object {item.label:<4} {lasting}, {_count(item.tracks, 'point')}")
    if len(result.objects) > _SHOWN:
        lines.append(f"  and {len(result.objects) - _SHOWN} more")
    lines.append(f"  points      {_points(result)}")
    lines += [f"  {clock(event.time_s):<11} {event.text}" for event in result.events[:_SHOWN]]
    if len(result.events) > _SHOWN:
        lines.append(f"  and {len(result.events) - _SHOWN} more events")
    written = (result.output, result.labels, *result.further)
    lines += [f"  wrote       {path}" for path in written if path is not None]
    lines.append(f"  speed       {_speed(result, seconds)}")
    lines += [f"  warning     {text}" for text in result.warnings]
    return "\n".join(lines)


def _headline(name: str, result: Result) -> str:
    frames = result.counts.frames
    length = f"{_count(frames, 'frame')}, {float(frames / result.info.fps):.1f} s"
    count = len(result.objects)
    moving = "nothing moves by itself" if not count else f"{_count(count, 'moving object')}"
    return f"{name}: {moving} in {length}"


def _points(result: Result) -> str:
    """Tracks in all, and how the rows divide."""
    counts = result.counts
    if counts.rows == 0:
        return "none"
    kinds = {"background": counts.background, "moving": counts.moving, "undecided": counts.undecided}
    parts = ", ".join(f"{100 * number / counts.rows:.1f} % {kind}" for kind, number in kinds.items())
    return f"{_count(counts.tracks, 'track')}; of all rows {parts}"


def _speed(result: Result, seconds: float) -> str:
    stages = ", ".join(f"{stage} {spent:.1f} s" for stage, spent in result.seconds.items())
    return f"{result.counts.frames / max(seconds, 1e-9):.1f} frames per second ({stages})"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
