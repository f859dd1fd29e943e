"""Trajectories made from a known model: a rigid world and boxes that move, seen by a camera that moves.

World coordinates are metres, x right, y down, z ahead, with the camera of the middle frame in the origin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from ifsvideo.types import Tracks

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SIZE = (640, 480)
FOCAL = 512.0


@dataclass(frozen=True)
class Mover:
    """A box of points: centre in the middle frame and extent (metres), velocity (metres a frame) and how
    that changes (metres a frame, each frame)."""

    centre: tuple[float, float, float]
    velocity: tuple[float, float, float]
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    extent: tuple[float, float, float] = (2.0, 1.5, 2.0)
    points: int = 30


@dataclass(frozen=True)
class Camera:
    """Rotations (F, 3, 3) and centres (F, 3): a point X is seen along ``R (X - centre)``."""

    R: Array
    centre: Array

    @classmethod
    def path(
        cls,
        frames: int = 20,
        step: tuple[float, float, float] = (0.0, 0.0, 0.3),
        turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
        shake: float = 0.005,
    ) -> Camera:
        """Constant speed ``step`` (metres a frame) and ``turn`` (radians a frame), and a shaking hand
        (radians)."""
        time = np.arange(frames) - (frames - 1) / 2
        swing = shake * np.column_stack([np.sin(1.3 * time), np.cos(0.7 * time), 0.3 * np.sin(0.4 * time)])
        R = Rotation.from_rotvec(time[:, None] * np.array(turn) + swing).as_matrix()
        return cls(R, time[:, None] * np.array(step))

    def see(self, world: Array) -> tuple[Array, Array]:
        """Pictures (F, P, 2), pixels, and depths (F, P), of points that lie at (F, P, 3)."""
        seen = np.einsum("fij,fpj->fpi", self.R, world - self.centre[:, None])
        depth = seen[..., 2]
        centre = (np.array(SIZE) - 1) / 2
        return FOCAL * seen[..., :2] / np.maximum(depth, 1e-6)[..., None] + centre, depth


@dataclass(frozen=True)
class Scene:
    """Tracks, the true motion of each (0 the static world, 1, 2, ... the movers), and what made them."""

    tracks: Tracks
    truth: Ints
    camera: Camera
    world: Array

    def with_gaps(self, seed: int = 0, least: int = 8) -> Scene:
        """The same scene where each track is born and dies at random, living ``least`` frames or more."""
        rng = np.random.default_rng(seed)
        frames, points = self.tracks.visible.shape
        life = rng.integers(least, frames + 1, points)
        birth = (rng.random(points) * (frames - life + 1)).astype(int)
        time = np.arange(frames)[:, None]
        alive = (time >= birth) & (time < birth + life)
        tracks = Tracks.from_array(self.tracks.xy, alive, self.tracks.ids, SIZE)
        return replace(self, tracks=tracks)


def make_scene(
    camera: Camera | None = None,
    movers: tuple[Mover, ...] = (),
    *,
    static: int = 200,
    depth: tuple[float, float] = (8.0, 80.0),
    noise: float = 0.1,
    seed: int = 0,
) -> Scene:
    """Static points, evenly over the picture and over the logarithm of depth, and movers before them.

    Only static points that stay in the picture are taken, so that every track is complete.
    """
    camera = camera or Camera.path()
    frames = len(camera.R)
    rng = np.random.default_rng(seed)
    middle = (np.array(SIZE) - 1) / 2
    pool = 30 * static
    bearing = (rng.uniform((0, 0), SIZE, (pool, 2)) - middle) / FOCAL
    z = np.exp(rng.uniform(*np.log(depth), pool))
    fixed = np.column_stack([bearing * z[:, None], z])
    xy, distance = camera.see(np.repeat(fixed[None], frames, axis=0))
    inside = ((xy >= 0) & (xy < SIZE)).all(axis=(0, 2)) & (distance > 1).all(axis=0)
    world = [np.repeat(fixed[inside][None, :static], frames, axis=0)]
    assert world[0].shape[1] == static, "the camera moves too far for this many static points"
    time = np.arange(frames) - (frames - 1) / 2
    for mover in movers:
        box = np.array(mover.centre) + rng.uniform(-0.5, 0.5, (mover.points, 3)) * mover.extent
        way = time[:, None] * np.array(mover.velocity) + time[:, None] ** 2 / 2 * np.array(mover.acceleration)
        world.append(box + way[:, None])
    truth = np.repeat(np.arange(len(world)), [w.shape[1] for w in world])
    everything = np.concatenate(world, axis=1)
    xy, _ = camera.see(everything)
    xy += rng.normal(0, noise, xy.shape) if noise else 0.0
    return Scene(Tracks.from_array(xy, size=SIZE), truth, camera, everything)


def affine_tracks(first: Array, maps: Array) -> Tracks:
    """Points (P, 2) that move by affine maps (F, 2, 3) exactly."""
    return Tracks.from_array(np.einsum("fij,pj->fpi", maps[..., :2], first) + maps[:, None, :, 2], size=SIZE)


def some_maps(frames: int, seed: int = 0) -> Array:
    """Affine maps (F, 2, 3), the first the identity, each later one a bit farther off."""
    rng = np.random.default_rng(seed)
    grown = np.arange(frames)[:, None, None]
    rate = np.dstack([rng.normal(0, 0.01, (1, 2, 2)), rng.normal(0, 3.0, (1, 2, 1))])
    return np.eye(2, 3) + grown * rate


def affine_motions(
    sizes: tuple[int, ...] = (60, 40), frames: int = 15, noise: float = 0.05, seed: int = 0
) -> tuple[Tracks, Ints]:
    """Clouds that each move by affine cameras of their own, in mixed order, and the cloud of each point."""
    rng = np.random.default_rng(seed)
    parts = []
    for size in sizes:
        cloud = rng.uniform(-1, 1, (size, 3))
        cameras = rng.normal(size=(1, 2, 3)) + 0.15 * np.cumsum(rng.normal(size=(frames, 2, 3)), axis=0)
        shift = rng.uniform(150, 330, 2) + np.cumsum(rng.normal(scale=5, size=(frames, 2)), axis=0)
        parts.append(60 * np.einsum("fij,pj->fpi", cameras, cloud) + shift[:, None])
    xy = np.concatenate(parts, axis=1)
    truth = np.repeat(np.arange(len(sizes)), sizes)
    order = rng.permutation(len(truth))
    xy += rng.normal(scale=noise, size=xy.shape)
    return Tracks.from_array(xy[:, order], size=SIZE), truth[order]


def share_wrong(labels: Ints, truth: Ints) -> float:
    """Share of points that the best one-to-one matching of labels to motions gets wrong."""
    rows, columns = np.unique(labels), np.unique(truth)
    shared = np.array([[np.count_nonzero((labels == r) & (truth == c)) for c in columns] for r in rows])
    return 1 - shared[linear_sum_assignment(-shared)].sum() / len(truth)


LEFT_CAR = Mover(centre=(-4.0, 0.5, 15.0), velocity=(0.25, 0.0, 0.3))
RIGHT_CAR = Mover(centre=(4.0, 0.5, 15.0), velocity=(-0.2, 0.0, 0.1))
