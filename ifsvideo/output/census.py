"""What a run tells of the whole clip, gathered frame by frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ifsvideo.types import BACKGROUND, Counts, Image, Ints, LabelTable, MovingObject, Scene

_GONE = 300
"""Frames after which a track that is not seen is taken not to be seen again."""


class Census:
    """Counts objects, tracks and rows (a `Sink`); memory grows with objects, not with time."""

    wants_image = False

    def __init__(self) -> None:
        self._frames = 0
        self._tracks = 0
        self._rows = np.zeros(3, np.int64)
        self._seen: dict[int, tuple[set[int], set[int]]] = {}
        """Tracks of every label, 0 for all: those seen of late, and those seen in the time before that."""
        self._objects: dict[int, MovingObject] = {}

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        self._frames = scene.frame + 1
        self._rows += np.bincount(np.sign(scene.labels) + 1, minlength=3)
        self._tracks += self._new(scene.ids, 0)
        for label in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
            tracks = self._new(scene.ids[scene.labels == label], label)
            before = self._objects.get(label, MovingObject(label, scene.time_s, scene.time_s, 0))
            self._objects[label] = MovingObject(label, before.first_s, scene.time_s, before.tracks + tracks)
        if scene.frame % _GONE == 0:
            self._seen = {label: (set(), late) for label, (late, _) in self._seen.items() if late}

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""

    @property
    def objects(self) -> tuple[MovingObject, ...]:
        """The moving objects, by number."""
        return tuple(self._objects[label] for label in sorted(self._objects))

    @property
    def counts(self) -> Counts:
        """How many frames, tracks and rows there were."""
        undecided, background, moving = self._rows.tolist()
        return Counts(self._frames, self._tracks, background, moving, undecided)

    def _new(self, ids: Ints, label: int) -> int:
        """How many of these tracks have not been seen so far."""
        late, before = self._seen.setdefault(label, (set(), set()))
        new = set(ids.tolist()) - late
        late |= new
        return len(new - before)


class TableSink:
    """Keeps every row (a `Sink`): the one whose memory grows with points x frames, for the library's user."""

    wants_image = False

    def __init__(self) -> None:
        self._scenes: list[Scene] = []

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        self._scenes.append(replace(scene, trails=scene.trails[:0]))

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""

    @property
    def table(self) -> LabelTable:
        """All rows so far."""
        scenes = self._scenes
        counts = [len(scene.ids) for scene in scenes]
        return LabelTable(
            np.repeat(np.arange(len(scenes), dtype=np.int32), counts),
            np.concatenate([*(scene.ids for scene in scenes), np.empty(0, np.int64)]),
            np.concatenate([*(scene.xy for scene in scenes), np.empty((0, 2), np.float32)]),
            np.concatenate([*(scene.labels for scene in scenes), np.empty(0, np.int32)]),
            len(scenes),
        )
