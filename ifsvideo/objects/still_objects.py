"""Objects that are fixed to the camera though none of their tracks could be told to be.

Along the edge of a bonnet, or among the digits of a time that changes, tracks are short, or slide along the
edge as the road passes beneath. Each by itself does not stay put, but in most steps most of them do, and no
thing out there does that while the camera shakes: a car that is followed pitches with the world.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.camera_fixed import SHAKE_TO_SPREAD
from ifsvideo.objects.parting import lengths, middle
from ifsvideo.ordered import places
from ifsvideo.types import BACKGROUND, FramePoints, Ints

_LEAST_WORLD = 8
"""Fewest tracks of the background that two frames must share."""
_WORLD_GOES = 0.5
"""How far its middle track must go from one frame to the next, pixels of a 640x480 picture, for the step to
count: where the world rests, everything may."""
_STAYS = 0.1
"""Longest step, pixels of a 640x480 picture, that is taken for none. In dash_tunnel_exit.mp4 the middle step
of time and bonnet is 0.01, that of all else 0.9 and more; that of a rendered car that is followed, 1.7."""
_LEAST_STEPS = 10
"""Fewest steps by which an object is judged."""


def still_objects(
    points: Sequence[FramePoints], labels: Sequence[Ints], unit: float, config: ObjectsConfig
) -> set[int]:
    """Numbers of the objects that stay where they are in the picture while the world goes and shakes.

    Parameters
    ----------
    points : sequence of FramePoints, ordered by id
        Consecutive frames.
    labels : sequence of (N,) int
        Of these points: 0 background, 1, 2, ... objects.
    unit : float
        Pixels per pixel of a 640x480 picture.
    config : ObjectsConfig
    """
    steps: dict[int, list[NDArray[np.float64]]] = defaultdict(list)
    for (before, was), (after, now) in pairwise(zip(points, labels, strict=True)):
        if not (now > BACKGROUND).any():
            continue
        place, both = places(before.ids, after.ids)
        place = place[both]
        step = np.asarray(after.xy[place] - before.xy[both], np.float64)
        label = np.where(was[both] == now[place], now[place], -1)
        world = step[label == BACKGROUND]
        if len(world) < _LEAST_WORLD or middle(lengths(world)) < _WORLD_GOES * unit:
            continue
        common = middle(world)
        for number in np.unique(label[label > BACKGROUND]).tolist():
            steps[number].append(np.concatenate([middle(step[label == number]), common]))
    return {number for number, own in steps.items() if _stays(np.array(own), unit, config)}


def _stays(steps: NDArray[np.float64], unit: float, config: ObjectsConfig) -> bool:
    """Whether an object stays put, by its common steps and the world's (S, 4) in the same frames."""
    if len(steps) < _LEAST_STEPS or np.median(np.linalg.norm(steps[:, :2], axis=1)) > _STAYS * unit:
        return False
    spread, shake = np.linalg.norm(np.ptp(np.cumsum(steps, axis=0), axis=0).reshape(2, 2), axis=1)
    return bool(shake > max(config.fixed_shake * unit, SHAKE_TO_SPREAD * spread))
