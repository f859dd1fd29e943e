"""After stage 5: parts of the static world that a mover's own motion predicts better.

A thing that moves slowly fits one static world within two or three times the noise, and so the static world
keeps parts of it. But points that keep their places on one thing are, seen from it, a static world, too: its
cameras move as seen from the thing. A part that lies beside a mover is therefore predicted twice, by the
mover's world and by the static one, to neither of which it was fitted, and goes where it is predicted better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ifsvideo.segmentation.agglomeration import Window
from ifsvideo.segmentation.cues import Cues, Members
from ifsvideo.segmentation.median import median
from ifsvideo.segmentation.world import World
from ifsvideo.types import BACKGROUND

Array = NDArray[np.float64]
Labels = NDArray[np.int64]

_ROUNDS = 4
"""Times that all parts are asked: a mover that won a part predicts the next one better."""
_LEAST_POINTS = 10
"""Measured points that a world needs to predict others; fewer bend the cameras to their noise."""
_LEAST_PART = 3
"""Measured points of a part that is contested."""
_EXPLAINED = 1.0
"""Error of a mover's own points in its world, in tolerances, beyond which that world is none."""
_NOISE = 0.1
"""Least error of a mover's own points, in tolerances: fitted to few points, a world follows their noise."""
_PREDICTED = 2.5
"""Error of a part in a mover's world, over that of the mover's own points, up to which it may be of it."""
_RIVAL = 3.0
"""Error of a part in a mover's world, over that in the static one it was fitted to, up to which the static
world has to predict it, too."""
_REMOTE = 8.0
"""Distance of a part from a mover's rank-3 subspace, over that from the static world's, beyond which it is
surely none of it: asked first, for it costs next to nothing. Parts that were won had up to 4."""


def contested(
    labels: Labels, confidence: Array, window: Window, world: World, cues: Cues, reach: float
) -> tuple[Labels, Array]:
    """Give movers the parts of the static world that they predict better than it does.

    Parameters
    ----------
    labels : (P,) int64
        0 the static world, 1, 2, ... what moves.
    confidence : (P,) float
        Of the labels, 0 to 1.
    window : Window
        The parts are its segments.
    world : World
        Where the worlds of all groups start from.
    cues : Cues
    reach : float
        Distance of a part from a mover's points beyond which it is none of it, pixels.

    Returns
    -------
    labels : (P,) int64
    confidence : (P,) float
        A part that a mover won is as sure as the mover.
    """
    movers = [int(group) for group in np.unique(labels) if group > BACKGROUND]
    contest = _Contest(labels.copy(), confidence.copy(), window, world, cues, reach)
    for _ in range(_ROUNDS):
        winners = {contest.settle(*part, movers) for part in window.parts()} - {BACKGROUND}
        if not winners:
            break
        # A mover that won nothing would be fitted to the same points.
        for group in winners | {BACKGROUND}:
            contest.predictions.pop(group, None)
    return contest.labels, contest.confidence


@dataclass(frozen=True)
class _Prediction:
    """Where a group's own world has all points: their errors (P,), that of its own points, in tolerances."""

    error: Array
    own: float


class _Contest:
    def __init__(
        self, labels: Labels, confidence: Array, window: Window, world: World, cues: Cues, reach: float
    ) -> None:
        self.labels, self.confidence = labels, confidence
        self.window, self.world, self.cues, self.reach = window, world, cues, reach
        self.predictions: dict[int, _Prediction | None] = {}

    def settle(self, members: Members, reliable: Members, movers: list[int]) -> int:
        """The mover that wins a segment's points (members, and those that are measured), or the ground."""
        static = self.labels[members] == BACKGROUND
        if 2 * np.count_nonzero(static) <= len(members):
            return BACKGROUND
        part = members[static]
        measured = reliable[self.labels[reliable] == BACKGROUND]
        if len(measured) < _LEAST_PART:
            return BACKGROUND
        claims = [(self._claim(part, measured, mover), mover) for mover in movers]
        error, winner = min(claims, default=(np.inf, BACKGROUND))
        if not error < np.inf or not error < self._without(members, measured):
            return BACKGROUND
        self.confidence[part] = np.median(self.confidence[self.labels == winner])
        self.labels[part] = winner
        return winner

    def _claim(self, part: Members, measured: Members, mover: int) -> float:
        """Error of a part in a mover's world; infinite where it has no claim to it."""
        if not self._beside(part, measured, mover):
            return np.inf
        moving = self._prediction(mover)
        if moving is None or moving.own > _EXPLAINED:
            return np.inf
        error = median(moving.error[measured])
        if error >= _PREDICTED * moving.own:
            return np.inf
        # Last, for most parts are refused by then, and often all: the largest group takes longest to fit.
        static = self._prediction(BACKGROUND)
        known = static is not None and error < _RIVAL * median(static.error[measured])
        return error if known else np.inf

    def _beside(self, part: Members, measured: Members, mover: int) -> bool:
        """Whether a part is near a mover, in the picture and among motions."""
        points = np.flatnonzero(self.labels == mover)
        if cdist(self.cues.anchor[part], self.cues.anchor[points]).min(initial=np.inf) > self.reach:
            return False
        own, static = (self._rigid(group, measured) for group in (mover, BACKGROUND))
        return own <= _REMOTE * max(static, self.cues.noise)

    def _rigid(self, group: int, points: Members) -> float:
        """Distance of some points from a group's rank-3 subspace, pixels."""
        members = np.flatnonzero(self.labels == group)
        return median(self.cues.group(members, self._measured(members)).rigid[points])

    def _measured(self, members: Members) -> Members:
        """Those of some points that their segment's model explains, if there are two."""
        reliable = members[self.window.explained[members]]
        return reliable if len(reliable) >= 2 else members

    def _prediction(self, group: int) -> _Prediction | None:
        """What a group's world predicts; None where it has too few points."""
        if group not in self.predictions:
            self.predictions[group] = self._predicted_by(np.flatnonzero(self.labels == group))
        return self.predictions[group]

    def _without(self, members: Members, points: Members) -> float:
        """Error of some points in the static world without a segment (members); 0 where there is none."""
        static = self.labels == BACKGROUND
        static[members] = False
        prediction = self._predicted_by(np.flatnonzero(static))
        return 0.0 if prediction is None else median(prediction.error[points])

    def _predicted_by(self, members: Members) -> _Prediction | None:
        reliable = members[self.window.explained[members]]
        if len(reliable) < _LEAST_POINTS:
            return None
        world = self.world.fitted_to(reliable)
        error = np.nan_to_num(world.rms / world.tolerance)
        return _Prediction(error, max(median(error[reliable]), _NOISE))
