"""What happened to an object, in plain words: no more than the points carry.

Whatever is said of left and right, near and far is said of the picture; how far away something is, a single
camera cannot tell, but whether it grows, and whether its foot goes over the ground, it can.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.table import Event, ObjectTable
from ifsvideo.types import VideoInfo

KINDS = (
    "appears",
    "leaves",
    "overtakes",
    "is overtaken",
    "comes closer fast",
    "crosses",
    "stops",
    "is hidden",
)
"""Kinds of events; the text says more, such as the side."""
_GAP_S = 0.5
"""Out of sight for longer, seconds, an object was gone; shorter, its points were only lost for a moment."""
_EDGE_S = 0.5
"""What is in sight this near the beginning or end of a shot, seconds, was so before, or will be after."""
_NEAR_S = 0.4
"""Seconds at either end of a sight in which it is looked for how the object came or went."""
_OUT_S = 0.7
"""An object whose middle would be out of the picture so many seconds after its last sight has left it."""
_CONTACT_S = 3.0
"""Time to contact, seconds, under which something comes closer fast. Warnings of collision are asked for
between 2.0 and 2.4 s before it (NHTSA, New Car Assessment Program, Forward Collision Warning, 2013); a little
earlier is a good time to look."""
_LASTING_S = 0.2
"""Seconds for which it must be so, in four of five frames."""
_QUIET_S = 2.0
"""Seconds without it after which it is told again."""
_STOOD = 0.5
"""Share of the tracks that must be the background's before, or after, for an object to start or to stop."""
_RECEDES = 0.1
"""Growth, 1/s, beyond which something comes nearer, or below whose negative it goes away."""
_STILL = 0.002
"""Motion of the background, shares of the diagonal a second, below which the camera stands still."""
_SIDES = ("left", "right", "top", "bottom")


@dataclass(frozen=True)
class Sights:
    """One object while it is in sight without a gap.

    Attributes
    ----------
    rows : ObjectTable
    foot : (N,) float64
        As of `ifsvideo.objects.kinematics.foot_step`, pixels per frame; NaN where nothing can be said.
    around : (N,) float64
        Length of the step of the background around it, pixels per frame; NaN where not known.
    stood_before, stood_after : float
        As of `ifsvideo.objects.standing.Standing`.
    again : bool
        Whether it was seen before this.
    shot : (first, stop)
        Frames between two cuts, or the ends of the clip, in which it is seen.
    """

    rows: ObjectTable
    foot: NDArray[np.float64]
    around: NDArray[np.float64]
    stood_before: float
    stood_after: float
    again: bool
    shot: tuple[int, int]


def split(frame: NDArray[np.int32], fps: float) -> list[slice]:
    """The stretches without a gap of an object's rows, by their frames (N,), ascending."""
    cuts = np.flatnonzero(np.diff(frame) > _GAP_S * fps) + 1
    return [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), len(frame)])]


def events_of(sights: Sights, info: VideoInfo) -> Iterator[Event]:
    """What happened to an object while it was in sight."""
    rows = sights.rows
    fps = float(info.fps)
    name = f"object {rows.object[0]}"

    def event(row: int, kind: str, text: str) -> Event:
        time_s, number = float(rows.time_s[row]), int(rows.object[row])
        return Event(int(rows.frame[row]), time_s, number, kind, f"{name} {text}")

    borders = _borders(rows, info)
    near = max(1, round(_NEAR_S * fps))
    yield event(0, "appears", _appearing(sights, borders[:near], fps))
    side = _passing(sights, borders, info)
    if side is not None:
        yield event(0, "overtakes", f"overtakes on the {side}")
    for row in _closing(rows, fps):
        yield event(row, "comes closer fast", f"comes closer fast: contact in {rows.ttc_s[row]:.1f} s")
    crossed = _crossing(rows, info)
    if crossed is not None:
        row, way = crossed
        yield event(row, "crosses", f"crosses from {way}")
    if sights.shot[1] - rows.frame[-1] <= _EDGE_S * fps:
        return
    side_out = _leaving(rows, borders[-near:], info)
    if side_out is not None and _falls_behind(sights, side_out, fps):
        yield event(-1, "is overtaken", f"is overtaken, on the {side_out}")
    if side_out is not None:
        yield event(-1, "leaves", f"leaves {_place(side_out)}")
    elif sights.stood_after >= _STOOD:
        yield event(-1, "stops", "stops: its points stand still with the background")
    else:
        yield event(-1, "is hidden", "is out of sight: hidden, or too small or blurred to follow")


def _borders(rows: ObjectTable, info: VideoInfo) -> NDArray[np.bool_]:
    """Whether the box lies on the left, right, top and bottom edge of the picture, (N, 4)."""
    right, bottom = rows.left + rows.width, rows.top + rows.height
    at = (rows.left <= -0.5, right >= info.width - 0.5, rows.top <= -0.5, bottom >= info.height - 0.5)
    return np.stack(at, axis=1)


def _appearing(sights: Sights, borders: NDArray[np.bool_], fps: float) -> str:
    first = sights.shot[0]
    if sights.rows.frame[0] - first <= _EDGE_S * fps:
        return "is in sight at the beginning" + (" of a shot" if first > _EDGE_S * fps else "")
    if sights.stood_before >= _STOOD:
        return "starts to move"
    again = " again" if sights.again else ""
    touched = np.flatnonzero(borders.any(axis=0))
    return f"appears{again} {_place(_SIDES[touched[0]])}" if len(touched) else f"appears{again}"


def _place(side: str) -> str:
    return f"on the {side}" if side in ("left", "right") else f"at the {side}"


def _passing(sights: Sights, borders: NDArray[np.bool_], info: VideoInfo) -> str | None:
    """Side on which it came past us: in over the edge, and on ahead, our way; None if it did not."""
    rows, fps = sights.rows, float(info.fps)
    touched = borders[: max(1, round(_NEAR_S * fps)), :2].any(axis=0)
    if rows.frame[0] - sights.shot[0] <= _EDGE_S * fps or not touched.any():
        return None
    side = int(np.argmax(touched))
    at_edge = np.flatnonzero(borders[:, side])
    gone = at_edge[np.diff(at_edge, append=len(rows)) > _EDGE_S * fps]
    if not len(gone):
        return None
    first = slice(0, int(gone[0]) + round(fps))
    goes_our_way = _median(sights.foot[first]) < 0
    recedes = _median(rows.scale_rate[first]) < -_RECEDES
    moving = _median(sights.around[first]) * fps > _STILL * np.hypot(info.width, info.height)
    return _SIDES[side] if goes_our_way and recedes and moving else None


def _falls_behind(sights: Sights, side: str, fps: float) -> bool:
    """Whether it goes our way and we come nearer, in the last second before it leaves to the side."""
    last = slice(-round(fps), None)
    grows = _median(sights.rows.scale_rate[last]) > _RECEDES
    return side in ("left", "right") and grows and _median(sights.foot[last]) < 0


def _closing(rows: ObjectTable, fps: float) -> Iterator[int]:
    """Rows in which contact begins to be near."""
    lasting = max(2, round(_LASTING_S * fps))
    soon = rows.ttc_s < _CONTACT_S
    told = -np.inf
    for row in np.flatnonzero(soon).tolist():
        if row - told < _QUIET_S * fps:
            told = row
        elif soon[row : row + lasting].sum() >= 0.8 * lasting:
            yield row
            told = row


def _crossing(rows: ObjectTable, info: VideoInfo) -> tuple[int, str] | None:
    """Row in which it passes the middle of the picture on its way from one side to the other, and the way."""
    third = info.width / 3
    for way, sign in (("left to right", 1), ("right to left", -1)):
        place = rows.cx if sign > 0 else info.width - rows.cx
        here, there = np.flatnonzero(place < third), np.flatnonzero(place > 2 * third)
        there = there[there > here[0]] if len(here) else there[:0]
        if not len(there):
            continue
        start, stop = int(here[here < there[0]][-1]), int(there[0])
        own = np.nansum(rows.vx[start:stop]) / float(info.fps) * sign
        if own > 0.5 * (place[stop] - place[start]):
            return start + int(np.argmax(place[start : stop + 1] > info.width / 2)), way
    return None


def _leaving(rows: ObjectTable, borders: NDArray[np.bool_], info: VideoInfo) -> str | None:
    """Side on which it left the picture; None if it did not leave over the edge."""
    last = len(borders)
    seconds = np.arange(1 - last, 1) / float(info.fps)
    cx, cy = rows.cx[-last:], rows.cy[-last:]
    outwards = (-cx, cx - info.width, -cy, cy - info.height)
    best, found = 0.0, None
    for side, beyond in zip(_SIDES, outwards, strict=True):
        speed = np.polyfit(seconds, beyond, 1)[0] if last > 1 else 0.0
        ahead = float(beyond[-1] + speed * _OUT_S)
        touches = bool(borders[-1, _SIDES.index(side)]) and speed > 0
        if (ahead > 0 or touches) and (found is None or speed > best):
            best, found = speed, side
    return found


def _median(values: NDArray[np.floating]) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")
