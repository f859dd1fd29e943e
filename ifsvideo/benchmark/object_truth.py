"""What is true of objects in the sample clips: boxes from masks, contact from poses, the script of events."""

from __future__ import annotations

import csv
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.errors import InputError
from ifsvideo.objects.events import KINDS

_FIELDS = ("masks", "camera", "poses")


@dataclass(frozen=True)
class ObjectTruth:
    """The truth of one clip, F frames and N objects.

    Attributes
    ----------
    masks : (F, H, W) uint8
    boxes : (F, N, 4) float64
        Left, top, right, bottom of the silhouettes, pixels; NaN where an object is not in the picture.
    approach : (F, N) float64
        1/s: how fast the distance of the object's middle from the camera's plane shrinks, over the distance.
    events : tuple of (seconds, object, kind)
    """

    masks: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    approach: NDArray[np.float64]
    events: tuple[tuple[float, int, str], ...]


def load_truth(truth: Path, fps: float) -> ObjectTruth:
    """Read ``NAME_truth.npz`` and, beside it, ``NAME_events.csv``.

    Raises
    ------
    InputError
        If either cannot be read or does not hold what is needed.
    """
    try:
        with np.load(truth) as content:
            masks, camera, poses = (content[name] for name in _FIELDS)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(
            f"{truth}: holds no {', '.join(_FIELDS)} ({fault}); render the sample clips again"
        ) from fault
    script = truth.with_name(truth.name.replace("_truth.npz", "_events.csv"))
    boxes = np.array([[_box(mask == k + 1) for k in range(poses.shape[1])] for mask in masks])
    boxes = boxes.reshape(*poses.shape[:2], 4)
    return ObjectTruth(masks, boxes, _approach(camera, poses, fps), _script(script))


def _box(mask: NDArray[np.bool_]) -> list[float]:
    if not mask.any():
        return [np.nan] * 4
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    return [columns[0] - 0.5, rows[0] - 0.5, columns[-1] + 0.5, rows[-1] + 0.5]


def _approach(camera: NDArray[Any], poses: NDArray[Any], fps: float) -> NDArray[np.float64]:
    """Rate (F, N) at which objects near the camera's plane, 1/s."""
    depth: NDArray[np.float64] = (camera[:, None] @ poses)[:, :, 2, 3]
    if depth.size == 0:
        return depth
    return np.asarray(-np.gradient(depth, axis=0) * fps / depth)


def _script(file: Path) -> tuple[tuple[float, int, str], ...]:
    try:
        with file.open(encoding="ascii", newline="") as stream:
            rows = [(float(row["time_s"]), int(row["object"]), row["kind"]) for row in csv.DictReader(stream)]
    except (OSError, ValueError, KeyError) as fault:
        raise InputError(f"{file}: is no list of events ({fault}); take it from the sample clips") from fault
    unknown = next((kind for _, _, kind in rows if kind not in KINDS), None)
    if unknown is not None:
        raise InputError(f"{file}: {unknown!r} is no kind of event; give one of {', '.join(KINDS)}")
    return tuple(rows)
