"""The seconds round each event, cut out of the input."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ifsvideo.objects.history import Event
from ifsvideo.output.atomic import Outputs
from ifsvideo.video.cutting import Cutter

OWN_FILES = r"\d+\.\d\ds-object-\d+-[a-z-]+\.(mp4|mov|mkv)"
"""What a folder of clips may hold to be replaced."""
_AROUND_S = 2.0
"""Seconds shown before and after: long enough to see how it came about and what came of it."""
_TOGETHER_S = 0.5
"""Events that follow within this time after the first, seconds, share its clip."""


def write_clips(folder: Path, source: Path, events: Sequence[Event], outputs: Outputs) -> dict[Event, str]:
    """Cut a clip for every event, or for several that happen at once.

    Parameters
    ----------
    folder : Path
        The clips are named after time, object and kind of their first event.
    source : Path
        The video.
    events : sequence of Event, by time
    outputs : Outputs
        Group with which the folder is placed.

    Returns
    -------
    dict of Event to str
        Name of the file that shows it.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    unfinished = outputs.add_folder(folder)
    cutter = Cutter(source) if events else None
    shown = {}
    for together in _groups(events):
        assert cutter is not None
        first = together[0]
        start, end = max(0.0, first.time_s - _AROUND_S), together[-1].time_s + _AROUND_S
        name = f"{first.time_s:07.2f}s-object-{first.object}-{first.kind.replace(' ', '-')}"
        file = cutter.cut(start, end, unfinished / name)
        shown.update(dict.fromkeys(together, file.name))
    return shown


def _groups(events: Sequence[Event]) -> Iterator[list[Event]]:
    """Events that share a clip."""
    group: list[Event] = []
    for event in events:
        if group and event.time_s > group[0].time_s + _TOGETHER_S:
            yield group
            group = []
        group.append(event)
    if group:
        yield group
