"""The summary of a run for programs: JSON, by the schema beside this file."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import imageio_ffmpeg
import numpy as np
import scipy

import ifsvideo
from ifsvideo.objects.history import Event, ObjectHistory, ObjectTable
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Result

VERSION = 1
"""Version of the format; it rises when something is renamed, removed or means something else."""
_PATH_HZ = 5.0
"""Places of an object's path a second; the CSV of objects has every frame."""


def schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) that every summary keeps to."""
    text = Path(__file__).with_name("summary.schema.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def summary_document(
    result: Result,
    source: Path | None,
    frames: int,
    history: ObjectHistory,
    clip_of: Mapping[Event, str],
    settings: Mapping[str, Any],
    written: Mapping[str, Path | None],
) -> dict[str, Any]:
    """What is told of a run.

    Parameters
    ----------
    result : Result
    source : Path or None
        Where the input was read from.
    frames : int
        Frames that were read.
    history : ObjectHistory
        Finished.
    clip_of : mapping of Event to the file that shows it
    settings : mapping
        What the run was told.
    written : mapping of an output's name to its place; None was not asked for
    """
    info = result.info
    return {
        "format": "ifsvideo summary",
        "version": VERSION,
        "input": {
            "path": None if source is None else str(source),
            "width": info.width,
            "height": info.height,
            "fps": str(info.fps),
            "frames": frames,
            "start_s": round(info.start, 4),
            "end_s": round(info.time_of(frames), 4),
        },
        "settings": dict(settings),
        "versions": {
            "ifsvideo": ifsvideo.__version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "opencv": cv2.__version__,
            "ffmpeg": imageio_ffmpeg.get_ffmpeg_version(),
        },
        "seconds": {stage: round(spent, 3) for stage, spent in result.seconds.items()},
        "objects": [
            {
                "object": item.label,
                "first_s": round(item.first_s, 4),
                "last_s": round(item.last_s, 4),
                "tracks": item.tracks,
                **_told(history.table.of(item.label), float(info.fps)),
            }
            for item in result.objects
        ],
        "events": [
            {
                "frame": event.frame,
                "time_s": round(event.time_s, 4),
                "object": event.object,
                "kind": event.kind,
                "text": event.text,
                "clip": clip_of.get(event),
            }
            for event in history.events
        ],
        "outputs": {name: str(path) for name, path in written.items() if path is not None},
        "warnings": list(result.warnings),
    }


def write_summary(path: Path, document: Mapping[str, Any], outputs: Outputs) -> None:
    """Write a summary.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with outputs.text(path) as file:
        file.write(json.dumps(document, indent=2, default=str, allow_nan=False) + "\n")


def _told(rows: ObjectTable, fps: float) -> dict[str, Any]:
    """What the table tells of one object."""
    shortest = rows.ttc_s[np.isfinite(rows.ttc_s)]
    every = max(1, round(fps / _PATH_HZ))
    path = zip(rows.time_s[::every], rows.cx[::every], rows.cy[::every], strict=True)
    return {
        "frames": len(rows),
        "shortest_ttc_s": round(float(shortest.min()), 2) if len(shortest) else None,
        "path": [[round(float(t), 4), round(float(x), 2), round(float(y), 2)] for t, x, y in path],
    }
