"""The rows that are told of objects, and what happened to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools, Ints


@dataclass(frozen=True)
class ObjectTable:
    """One row for every object and frame in which it is seen, ordered by frame, then object.

    Lengths are pixels of the upright picture; NaN where nothing can be said.

    Attributes
    ----------
    frame : (N,) int32, from 0.
    time_s : (N,) float64, seconds of the input.
    object : (N,) int32, number of the object, 1, 2, ...
    points : (N,) int32, points seen on it.
    left, top, width, height : (N,) float32
        Box round the object. Its sides lie between pixels' middles: a box over all of a 640x360 picture has
        left -0.5, top -0.5, width 640, height 360.
    cx, cy : (N,) float32, middle of the box.
    vx, vy : (N,) float32
        Velocity against the background around it, pixels per second.
    scale_rate : (N,) float32
        Growth of its lengths in the picture, 1/s: 0.5 is half as long again per second; below 0 it shrinks.
    ttc_s : (N,) float32
        Time to contact, seconds: until it reaches the camera's plane if it goes on as it does. NaN unless it
        grows beyond noise, and above 20 s.
    ttc_confidence : (N,) float32
        How sure it is that it grows, 0 to 1; 0 where ``ttc_s`` is NaN.
    """

    frame: NDArray[np.int32]
    time_s: NDArray[np.float64]
    object: NDArray[np.int32]
    points: NDArray[np.int32]
    left: NDArray[np.float32]
    top: NDArray[np.float32]
    width: NDArray[np.float32]
    height: NDArray[np.float32]
    cx: NDArray[np.float32]
    cy: NDArray[np.float32]
    vx: NDArray[np.float32]
    vy: NDArray[np.float32]
    scale_rate: NDArray[np.float32]
    ttc_s: NDArray[np.float32]
    ttc_confidence: NDArray[np.float32]

    def __post_init__(self) -> None:
        for item in fields(self):
            shape = getattr(self, item.name).shape
            if shape != (len(self.frame),):
                raise ValueError(f"expected {item.name} of shape ({len(self.frame)},), got {shape}")
        if (np.diff(self.frame) < 0).any():
            raise ValueError("rows must be ordered by frame")

    @classmethod
    def empty(cls) -> ObjectTable:
        """A table without a row."""
        columns = [np.empty(0, np.float32) for _ in range(len(fields(cls)) - 4)]
        whole = np.empty(0, np.int32)
        return cls(whole, np.empty(0, np.float64), whole, whole, *columns)

    @classmethod
    def joined(cls, tables: Iterable[ObjectTable]) -> ObjectTable:
        """All rows of several tables, ordered."""
        parts = [cls.empty(), *tables]
        names = [item.name for item in fields(cls)]
        columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        order = np.lexsort((columns["object"], columns["frame"]))
        return cls(**{name: column[order] for name, column in columns.items()})

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def numbers(self) -> list[int]:
        """The objects' numbers, in order."""
        return [int(number) for number in np.unique(self.object)]

    def of(self, number: int) -> ObjectTable:
        """The rows of one object."""
        return self.select(self.object == number)

    def select(self, rows: Bools | Ints) -> ObjectTable:
        """Some of the rows: a mask (N,) or ascending indices."""
        return ObjectTable(*(getattr(self, item.name)[rows] for item in fields(self)))


@dataclass(frozen=True)
class Event:
    """Something that happened to an object.

    Attributes
    ----------
    frame : int, from 0.
    time_s : float, seconds of the input.
    object : int, number of the object.
    kind : str
        One of `ifsvideo.objects.events.KINDS`.
    text : str
        A sentence for people, without the time: "object 3 overtakes on the left".
    """

    frame: int
    time_s: float
    object: int
    kind: str
    text: str
