"""From the points of every frame to a label for every observation, shot by shot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.numbering import Numbers
from ifsvideo.objects.shot import BeginWindow, Frame, Shot
from ifsvideo.tracking.steps import Step


def label_frames(
    steps: Iterable[Step],
    label: BeginWindow,
    config: ObjectsConfig,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
    scale: float = 1.0,
) -> Iterator[Frame]:
    """Yield the frames, their labels final, some time after they came: see `Shot`.

    A cut ends a shot: tracks and objects begin anew. A frame that repeats the one before is no sign that
    anything stands still: it is left out of the windows, unless that goes on for ``config.longest_freeze_s``,
    and has the labels of the frame that it repeats.

    Parameters
    ----------
    steps : iterable of Step
    label : callable
        Begins to label a window.
    config : ObjectsConfig
    size : (width, height) of the picture, or None where nobody told.
    fps : float or None
    scale : float
        Share of the picture's size in which it was tracked.
    """
    rate = fps or 30.0
    numbers = count(1)
    shot: Shot | None = None
    frozen = 0
    for place, step in enumerate(steps):
        if shot is not None and step.cut:
            yield from shot.finish()
            shot = None
        if shot is None:
            following = Numbers(numbers, config.least_seconds * rate)
            shot = Shot(label, following, config, size, fps, scale)
        frozen = frozen + 1 if step.repeats else 0
        last = shot.last
        if last is not None and 0 < frozen <= config.longest_freeze_s * rate:
            last.shown += 1
        else:
            yield from shot.add(Frame(place, step.points, step.picture))
    if shot is not None:
        yield from shot.finish()
