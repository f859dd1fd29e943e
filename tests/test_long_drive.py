"""Five simulated minutes: thirty objects that cross, overtake and are hidden, in windows that name them anew.

What moves together is told to the linking, so that it alone is tested: which object is which.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from ifsvideo.benchmark import metrics
from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.labelling import label_frames
from ifsvideo.objects.windows import WindowLabeller
from ifsvideo.tracking.steps import Step
from ifsvideo.types import FramePoints, Segmentation, Tracks

from .test_labelling import Made

FPS, SECONDS, SIZE = 10.0, 300, (640, 480)
OBJECTS, POINTS, GROUND = 30, 14, 60
HIDDEN_S = 0.5


@dataclass
class Drive:
    """Points of every frame, and the object (0: ground) of every track."""

    steps: list[Step] = field(default_factory=list)
    owner: list[int] = field(default_factory=list)

    def born(self, owner: int) -> int:
        """Id of a new track."""
        self.owner.append(owner)
        return len(self.owner) - 1


@dataclass
class Car:
    """Where an object is, when it is there, and when something hides it."""

    number: int
    begin: int
    end: int
    place: np.ndarray
    velocity: np.ndarray
    shape: np.ndarray
    hidden: list[int]
    ids: list[int] = field(default_factory=list)

    def seen(self, frame: int) -> bool:
        hidden = any(start <= frame < start + HIDDEN_S * FPS for start in self.hidden)
        return self.begin <= frame < self.end and not hidden

    def points(self, frame: int) -> np.ndarray:
        swing = 8 * np.sin(0.02 * frame + self.number)
        return self.place + (frame - self.begin) * self.velocity + swing + self.shape


def cars(rng: np.random.Generator) -> list[Car]:
    made = []
    for number in range(1, OBJECTS + 1):
        begin = int(rng.uniform(0, SECONDS - 25) * FPS)
        length = int(rng.uniform(12, 25) * FPS)
        right = rng.random() < 0.5
        place = np.array([-20.0 if right else 660.0, rng.uniform(200, 320)])
        velocity = np.array([680 / length * (1 if right else -1), rng.uniform(-0.2, 0.2)])
        hidden = (begin + np.array([0.3, 0.5, 0.7]) * length).astype(int).tolist()
        shape = rng.uniform((-25, -15), (25, 15), (POINTS, 2))
        made.append(Car(number, begin, begin + length, place, velocity, shape, hidden))
    return made


def drive(seed: int = 0) -> Drive:
    """The points that a tracker would give: tracks end at random, and where the object is hidden."""
    rng = np.random.default_rng(seed)
    made = Drive()
    ground = rng.uniform((0, 0), SIZE, (GROUND, 2))
    still = [made.born(0) for _ in range(GROUND)]
    fleet = cars(rng)
    for frame in range(int(SECONDS * FPS)):
        ids, xy = [*still], [ground]
        for car in fleet:
            if not car.seen(frame):
                car.ids = []
                continue
            car.ids = car.ids or [made.born(car.number) for _ in range(POINTS)]
            car.ids = [made.born(car.number) if rng.random() < 0.03 else track for track in car.ids]
            ids += car.ids
            xy.append(car.points(frame) + rng.normal(0, 0.2, (POINTS, 2)))
        order = np.argsort(ids)
        places = np.concatenate(xy)[order].astype(np.float32)
        made.steps.append(Step(FramePoints(np.array(ids)[order], places)))
    return made


@dataclass
class Knows:
    """A segmenter that knows what moves together, names it anew in every window, and misses some of it."""

    owner: np.ndarray
    rng: np.random.Generator

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        owner = self.owner[tracks.ids]
        there = np.unique(owner[owner > 0])
        missed = there[self.rng.random(len(there)) < 0.03]
        name = dict(zip(there.tolist(), self.rng.permutation(len(there)) + 1, strict=True))
        labels = np.array([name.get(int(one), 0) for one in owner], np.int64)
        labels[np.isin(owner, missed)] = 0
        return Segmentation(labels, labels == 0, labels, np.ones(len(labels)))


def switches(labels: np.ndarray, truth: np.ndarray, frame: np.ndarray) -> int:
    """How often an object's number, the one most of its points have, is another than before."""
    changed = 0
    for number in range(1, OBJECTS + 1):
        last = 0
        rows = np.flatnonzero((truth == number) & (labels > 0))
        for group in np.split(rows, np.flatnonzero(np.diff(frame[rows])) + 1):
            if len(group):
                most = int(np.bincount(labels[group]).argmax())
                changed += last not in (0, most)
                last = most
    return changed


@pytest.mark.parametrize("seed", [0, 3])
def test_thirty_objects_keep_their_numbers(seed: int) -> None:
    made = drive(seed)
    config = ObjectsConfig()
    owner = np.array(made.owner)
    labeller = WindowLabeller(Knows(owner, np.random.default_rng(seed)), config)

    def label(tracks: Tracks) -> Made:
        return Made(labeller(tracks))

    frames = list(label_frames(made.steps, label, config, SIZE, FPS))
    labels = np.concatenate([frame.labels for frame in frames])
    truth = owner[np.concatenate([frame.points.ids for frame in frames])]
    frame = np.repeat(np.arange(len(frames)), [len(one.labels) for one in frames])
    print(
        "idf1",
        metrics.idf1(labels, truth),
        "switches",
        switches(labels, truth, frame),
        len(np.unique(labels)),
    )
    assert metrics.idf1(labels, truth) >= 90
    assert switches(labels, truth, frame) <= OBJECTS / 10
