"""What happened to an object, in plain words: no more than the points carry.

Whatever is said of left and right, near and far is said of the picture; how far away something is, a single
camera cannot tell, but whether it grows, and whether its foot goes over the ground, it can.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.margins import GAP_S, Margin
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
_PASSED = 0.5
"""Share of the tracks that must be another object's just before, or after, for it to be that object."""
_RADIAL = 2.0
"""How many times as far as its growth explains an object may move in the picture if it keeps beside our way:
such a one moves away from the picture's middle as it grows. The rest is left to the camera's turns."""
_UNSURE = 2.0
"""How many times too slow the growth of what comes closer fast may seem before that is known: growth of few
points is no better measured."""
_PACE = 0.5
"""How fast the foot of what goes our way must go up the picture beside the ground there, over how fast its
height changes: over flat ground, camera and car 1.5 m high, that is a third of our speed. Less is within the
error of a foot that is told by few points."""
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
    before, after : Margin
        How its tracks go on beyond either end.
    again : bool
        Whether it was seen before this.
    shot : (first, stop)
        Frames between two cuts, or the ends of the clip, in which it is seen.
    """

    rows: ObjectTable
    foot: NDArray[np.float64]
    around: NDArray[np.float64]
    before: Margin
    after: Margin
    again: bool
    shot: tuple[int, int]

    @property
    def first(self) -> int:
        """Frame since which it is in sight, though not yet known to move."""
        return int(self.rows.frame[0]) - (0 if self.before.lasts else self.before.frames)

    @property
    def last(self) -> int:
        """Frame up to which it is in sight."""
        return int(self.rows.frame[-1]) + (0 if self.after.lasts else self.after.frames)


def split(frame: NDArray[np.int32], fps: float, bridged: Mapping[int, int]) -> list[slice]:
    """The stretches without a gap of an object's rows, by their frames (N,), ascending.

    ``bridged`` tells of the first frame after a gap how far back the tracks that are seen in it go, frames.
    """
    gaps = np.diff(frame)
    after = np.flatnonzero(gaps > GAP_S * fps) + 1
    cuts = [k for k in after.tolist() if bridged.get(int(frame[k]), 0) < gaps[k - 1]]
    return [slice(a, b) for a, b in pairwise([0, *cuts, len(frame)])]


def events_of(sights: Sights, info: VideoInfo) -> Iterator[Event]:
    """What happened to an object while it was in sight."""
    rows, fps = sights.rows, float(info.fps)
    number = int(rows.object[0])

    def event(frame: int, kind: str, text: str) -> Event:
        return Event(frame, info.time_of(frame), number, kind, f"object {number} {text}")

    first, side_in = _coming(sights, info)
    if sights.before.passed < _PASSED:
        yield event(first, "appears", _appearing(sights, first, side_in, info))
        side = _passing(sights, info) if side_in else None
        if side is not None:
            yield event(first, "overtakes", f"overtakes on the {side}")
    for frame, contact_s in _closing(sights, fps):
        yield event(frame, "comes closer fast", f"comes closer fast: contact in {contact_s:.1f} s")
    crossed = _crossing(rows, info)
    if crossed is not None:
        row, way = crossed
        yield event(int(rows.frame[row]), "crosses", f"crosses from {way}")
    last, side_out = _going(sights, info)
    if sights.shot[1] - last <= _EDGE_S * fps or sights.after.passed >= _PASSED:
        return
    if sights.after.lasts:
        yield event(last, "stops", "stops: its points stand still with the background")
    elif side_out is None:
        yield event(last, "is hidden", "is out of sight: hidden, or too small or blurred to follow")
    else:
        if _falls_behind(sights, side_out, info):
            yield event(last, "is overtaken", f"is overtaken, on the {side_out}")
        yield event(last, "leaves", f"leaves {_place(side_out)}")


def _coming(sights: Sights, info: VideoInfo) -> tuple[int, str | None]:
    """Frame since which the object is in sight, and the side on which it came into the picture, if it did."""
    if sights.before.lasts:
        return sights.first, None
    near = sights.rows.select(np.arange(_near(sights.rows, info)))
    beyond, side = over_edge(near, -1, sights.before.shift, info)
    first = sights.first - beyond
    at_once = first - sights.shot[0] <= _EDGE_S * float(info.fps)
    return (sights.shot[0], None) if at_once else (first, side)


def _going(sights: Sights, info: VideoInfo) -> tuple[int, str | None]:
    """Frame up to which the object is in sight, and the side on which it left the picture, if it did."""
    if sights.after.lasts:
        return sights.last, None
    near = sights.rows.select(np.arange(len(sights.rows))[-_near(sights.rows, info) :])
    beyond, side = over_edge(near, 1, sights.after.shift, info)
    return min(sights.shot[1] - 1, sights.last + beyond), side


def _near(rows: ObjectTable, info: VideoInfo) -> int:
    """Rows at either end of a sight in which it is looked for how the object came or went."""
    return min(len(rows), max(1, round(_NEAR_S * float(info.fps))))


def over_edge(
    rows: ObjectTable, towards: int, shift: NDArray[np.float64], info: VideoInfo
) -> tuple[int, str | None]:
    """Whether an object leaves the picture, or came into it, and how soon its box is on the edge.

    Parameters
    ----------
    rows : ObjectTable
        Its last rows, or its first.
    towards : int
        1: it is asked what follows them, -1: what was before.
    shift : (2,) float64
        How far on its points are seen, pixels.
    info : VideoInfo

    Returns
    -------
    frames : int
        How long after, or before, that the box is on the edge; 0 where it is already, or does not go there.
    side : str or None
    """
    fps, end = float(info.fps), -1 if towards > 0 else 0
    seconds = towards * np.arange(len(rows)) / fps
    dx, dy = shift.tolist()
    right, bottom = rows.left + rows.width - info.width, rows.top + rows.height - info.height
    # How far beyond the edge are the middle and the outer side of the box, then the step still to come.
    ways = (
        (-rows.cx, -rows.left, -dx),
        (rows.cx - info.width, right, dx),
        (-rows.cy, -rows.top, -dy),
        (rows.cy - info.height, bottom, dy),
    )
    best, soon, found = 0.0, 0.0, None
    for side, (middle, outer, step) in zip(_SIDES, ways, strict=True):
        speed = float(np.polyfit(seconds, middle, 1)[0]) if len(rows) > 1 else 0.0
        touches = outer[end] >= -0.5 - 1e-3 and (speed > 0 or towards < 0)
        out = float(middle[end]) + step + speed * _OUT_S > 0
        if (out or touches) and (found is None or speed > best):
            best, found = speed, side
            still = touches or speed <= 0
            soon = 0.0 if still else min(_OUT_S, max(0.0, -(float(outer[end]) + step) / speed))
    return round(soon * fps), found


def _appearing(sights: Sights, first: int, side: str | None, info: VideoInfo) -> str:
    begin, edge = sights.shot[0], _EDGE_S * float(info.fps)
    if first == begin:
        return "is in sight at the beginning" + (" of a shot" if begin > edge else "")
    if sights.before.lasts:
        return "starts to move"
    again = " again" if sights.again else ""
    return f"appears{again} {_place(side)}" if side else f"appears{again}"


def _place(side: str) -> str:
    return f"on the {side}" if side in ("left", "right") else f"at the {side}"


def _passing(sights: Sights, info: VideoInfo) -> str | None:
    """Side on which it came past us: in over the edge, and on ahead, our way; None if it did not."""
    rows, fps = sights.rows, float(info.fps)
    borders = np.stack([rows.left <= -0.5, rows.left + rows.width >= info.width - 0.5], axis=1)
    touched = borders[: _near(rows, info)].any(axis=0)
    if not touched.any():
        return None
    side = int(np.argmax(touched))
    at_edge = np.flatnonzero(borders[:, side])
    gone = at_edge[np.diff(at_edge, append=len(rows)) > _EDGE_S * fps]
    if not len(gone):
        return None
    first = slice(0, int(gone[0]) + round(fps))
    recedes = _median(rows.scale_rate[first]) < -_RECEDES
    moving = _median(sights.around[first]) * fps > _STILL * np.hypot(info.width, info.height)
    return _SIDES[side] if recedes and moving and _goes_our_way(sights, first, info) else None


def _falls_behind(sights: Sights, side: str, info: VideoInfo) -> bool:
    """Whether it goes our way and we come nearer, in the last second before it leaves to the side."""
    last = slice(-round(float(info.fps)), None)
    grows = _median(sights.rows.scale_rate[last]) > _RECEDES
    return side in ("left", "right") and grows and _goes_our_way(sights, last, info)


def _goes_our_way(sights: Sights, part: slice, info: VideoInfo) -> bool:
    """Whether it goes over the ground as we do, and beside our way rather than across it."""
    fps, rate = float(info.fps), sights.rows.scale_rate[part]
    middle = sights.rows.cx[part] - (info.width - 1) / 2
    moved = abs(float(middle[-1] - middle[0]))
    explained = abs(float(np.nansum(rate * middle))) / fps
    pace = -_median(sights.foot[part]) * fps
    own = abs(_median(rate)) * _median(sights.rows.height[part])
    return bool(pace > _PACE * own and moved <= _RADIAL * explained)


def _closing(sights: Sights, fps: float) -> Iterator[tuple[int, float]]:
    """Frames in which contact begins to be near, and the time to it then, seconds."""
    rows = sights.rows
    lasting = max(2, round(_LASTING_S * fps))
    soon = rows.ttc_s < _CONTACT_S
    told = -np.inf
    for row in np.flatnonzero(soon).tolist():
        if row - told < _QUIET_S * fps:
            told = row
        elif soon[row : row + lasting].sum() >= 0.8 * lasting:
            frame = _onset(sights, row, fps)
            yield frame, float(rows.ttc_s[row] + (rows.frame[row] - frame) / fps)
            told = row


def _onset(sights: Sights, row: int, fps: float) -> int:
    """Frame since which contact has been near, if a row tells that it is.

    Growth is known late: it is taken over a while, of an object that must first be known to move. Back to
    where contact was `_CONTACT_S` ahead, if it came nearer as it does now, and nothing that was measured
    says otherwise.
    """
    rows = sights.rows
    contact = float(rows.frame[row] + rows.ttc_s[row] * fps)
    first = max(sights.first, int(np.ceil(contact - _CONTACT_S * fps)))
    far = rows.frame[:row][rows.ttc_s[:row] >= _UNSURE * _CONTACT_S]
    if len(far):
        first = max(first, int(far[-1]) + 1)
    between = (rows.frame >= first) & (rows.frame < rows.frame[row]) & np.isfinite(rows.scale_rate)
    expected = fps / (contact - rows.frame[between])
    if rows.scale_rate[between].sum() * _UNSURE < expected.sum():
        return int(rows.frame[row])
    return min(first, int(rows.frame[row]))


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


def _median(values: NDArray[np.floating]) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")
