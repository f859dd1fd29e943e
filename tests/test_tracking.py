"""Corners and KLT on pictures whose motion is known exactly."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from ifsvideo.config import TrackerConfig
from ifsvideo.errors import UsageError
from ifsvideo.tracking.drift import References
from ifsvideo.tracking.klt import Search
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import FramePoints, Tracks

WIDTH, HEIGHT = 320, 240


def texture(width: int, height: int, seed: int = 0, blur: float = 2.0) -> NDArray[np.float32]:
    """Smooth random grey levels, 0 to 255."""
    noise = np.random.default_rng(seed).normal(0, 1, (height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), blur)
    return np.asarray(np.clip(128 + 45 * smooth / smooth.std(), 0, 255), np.float32)


def picture(grey: Any) -> NDArray[np.uint8]:
    return np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


def warped(maps: Iterable[NDArray[np.float64]], blur: float = 2.0) -> list[NDArray[np.uint8]]:
    """Pictures of a large plane, each through its homography from plane to picture."""
    plane = texture(2 * WIDTH, 2 * HEIGHT, blur=blur)
    size, flags = (WIDTH, HEIGHT), cv2.INTER_CUBIC
    return [picture(cv2.warpPerspective(plane, m, size, flags=flags)) for m in maps]


def run(frames: Any, config: TrackerConfig | None = None, ignore: Any = None) -> list[FramePoints]:
    points = list(KltTracker(config or TrackerConfig(max_points=300)).track(frames, ignore))
    assert len(points) == len(frames)
    return points


def dense(points: list[FramePoints]) -> Tracks:
    return Trajectories.collect(points).window(0, len(points))


def centre_shift() -> NDArray[np.float64]:
    return np.array([[1, 0, -WIDTH / 2], [0, 1, -HEIGHT / 2], [0, 0, 1]])


def homographies(frames: int) -> list[NDArray[np.float64]]:
    """A camera that turns, comes nearer and tilts: up to 4 px a frame."""
    maps = []
    for f in range(frames):
        turn, zoom = 0.003 * f, 1 + 0.005 * f
        c, s = zoom * np.cos(turn), zoom * np.sin(turn)
        move = np.array([[c, -s, 2.0 * f], [s, c, -1.3 * f], [1.2e-6 * f, -0.8e-6 * f, 1]])
        maps.append(move @ centre_shift())
    return maps


def errors(tracks: Tracks, maps: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Distance of every point to where its place at birth has gone."""
    result = []
    for p in range(tracks.points):
        seen = np.flatnonzero(tracks.visible[:, p])
        born = np.append(tracks.xy[seen[0], p], 1)
        for f in seen[1:]:
            x, y, w = maps[f] @ np.linalg.solve(maps[seen[0]], born)
            result.append(np.hypot(x / w - tracks.xy[f, p, 0], y / w - tracks.xy[f, p, 1]))
    return np.array(result)


def test_follows_a_plane_to_a_tenth_of_a_pixel() -> None:
    maps = homographies(16)
    tracks = dense(run(warped(maps)))
    off = errors(tracks, maps)
    assert len(off) > 2000
    assert np.median(off) < 0.1
    assert np.percentile(off, 95) < 0.5
    assert np.median(tracks.visible.sum(axis=0)) >= 6


def test_keeps_the_types_ids_and_order_of_the_protocol() -> None:
    points = run(warped(homographies(8)))
    seen: set[int] = set()
    before: set[int] = set()
    for item in points:
        assert item.ids.dtype == np.int64
        assert item.xy.dtype == np.float32
        assert (np.diff(item.ids) > 0).all()
        now = set(item.ids.tolist())
        assert not (now - before) & seen, "an id came back"
        assert all(new > max(seen, default=-1) for new in now - seen)
        seen |= now
        before = now


def test_same_frames_same_points_and_a_tracker_can_be_used_again() -> None:
    frames = warped(homographies(6))
    tracker = KltTracker(TrackerConfig(max_points=200))
    for a, b in zip(tracker.track(frames), tracker.track(iter(frames)), strict=True):
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_array_equal(a.xy, b.xy)


def test_takes_no_frame_before_it_is_asked() -> None:
    taken = []
    frames = (taken.append(f) or frame for f, frame in enumerate(warped(homographies(4))))
    points = KltTracker().track(frames)
    next(points)
    assert taken == [0]
    next(points)
    assert taken == [0, 1]


@pytest.mark.parametrize("reach", [8, 40])
def test_covered_tracks_end(reach: int) -> None:
    """A textured board slides over a resting wall, from the left, ``reach`` frames of 5 px."""
    wall, board = texture(WIDTH, HEIGHT, 1), texture(WIDTH, HEIGHT, 2)
    frames = []
    for f in range(reach):
        scene = wall.copy()
        scene[60:180, : 5 * f] = board[60:180, WIDTH - 5 * f :] if f else scene[60:180, :0]
        frames.append(picture(scene))
    points = run(frames)
    first, last = points[0], points[-1]
    inside = (first.xy[:, 1] > 70) & (first.xy[:, 1] < 170) & (first.xy[:, 0] < 5 * (reach - 1) - 12)
    assert inside.sum() > (0 if reach == 8 else 20)
    assert np.isin(first.ids[inside], last.ids).mean() <= 0.05
    away = (first.xy[:, 1] < 45) | (first.xy[:, 1] > 195)
    assert np.isin(first.ids[away], last.ids).mean() > 0.95
    stays = np.isin(last.ids, first.ids[away])
    where = {int(i): xy for i, xy in zip(first.ids, first.xy, strict=True)}
    moved = [np.hypot(*(xy - where[int(i)])) for i, xy in zip(last.ids[stays], last.xy[stays], strict=True)]
    assert max(moved) < 0.1


def test_spreads_over_a_picture_whose_corner_is_richest() -> None:
    grey = 128 + (texture(WIDTH, HEIGHT, 3) - 128) * 0.25
    grey[:80, :100] = texture(100, 80, 4, blur=1.2)
    found = run([picture(grey)])[0].xy
    in_corner = (found[:, 0] < 100) & (found[:, 1] < 80)
    assert len(found) > 200
    assert 0.05 < in_corner.mean() < 0.25
    quarters = np.bincount(2 * (found[:, 0] > WIDTH / 2) + (found[:, 1] > HEIGHT / 2), minlength=4)
    assert quarters.min() > 0.15 * len(found)


@pytest.mark.parametrize("level", [0, 90, 255])
def test_nothing_to_see_no_points(level: int) -> None:
    assert all(len(item.ids) == 0 for item in run([np.full((50, 50, 3), level, np.uint8)] * 4))


def test_sensor_noise_is_not_chased() -> None:
    rng = np.random.default_rng(0)
    frames = [picture(120 + rng.normal(0, 2.5, (HEIGHT, WIDTH))) for _ in range(3)]
    assert max(len(item.ids) for item in run(frames)) <= 3


def test_corners_keep_their_distance() -> None:
    found = run([picture(texture(WIDTH, HEIGHT))])[0].xy
    apart = np.hypot(*(found[:, None] - found[None]).transpose(2, 0, 1)) + 1e9 * np.eye(len(found))
    assert apart.min() > TrackerConfig().min_distance * np.hypot(WIDTH, HEIGHT) - 1


def test_no_more_points_than_told() -> None:
    for limit in (1, 40):
        points = run(warped(homographies(5)), TrackerConfig(max_points=limit))
        assert max(len(item.ids) for item in points) <= limit
        assert len(points[0].ids) > 0.5 * limit


def test_an_emptied_place_fills_again() -> None:
    wall = texture(WIDTH, HEIGHT, 5)
    covered = wall.copy()
    covered[80:200, 60:260] = 128
    points = run([picture(wall)] * 2 + [picture(covered)] * 4 + [picture(wall)] * 4)
    within = [int(((p.xy > (70, 90)) & (p.xy < (250, 190))).all(axis=1).sum()) for p in points]
    assert within[1] > 40
    assert within[5] == 0
    assert within[-1] > 0.45 * within[1]
    assert points[-1].ids[-1] > points[1].ids[-1]
    assert max(len(item.ids) for item in points) == 300, "those of fuller places made room"


@pytest.mark.parametrize(("fps", "every"), [(1, 1), (10, 1), (15, 2), (25, 3), (None, 3), (120, 3)])
def test_what_comes_into_view_has_points_within_a_tenth_of_a_second(fps: float | None, every: int) -> None:
    plane = texture(2 * WIDTH, HEIGHT, 14)
    frames = [picture(plane[:, 16 * f : 16 * f + WIDTH]) for f in range(10)]
    points = list(KltTracker(TrackerConfig(max_points=300), fps).track(frames))
    newest = [int(item.ids.max()) for item in points]
    assert [f for f in range(1, 10) if newest[f] > newest[f - 1]] == list(range(every, 10, every))


def test_ignored_places_bear_no_points_and_end_those_that_come() -> None:
    plane = texture(2 * WIDTH, HEIGHT, 6)
    frames = [picture(plane[:, 6 * f : 6 * f + WIDTH]) for f in range(12)]
    ignore = np.zeros((HEIGHT, WIDTH), bool)
    ignore[:, 100:140] = True
    free = run(frames)
    masked = run(frames, ignore=ignore)
    place = [(item.xy[:, 0] > 99.5) & (item.xy[:, 0] < 139.5) for item in free]
    assert all(p.sum() > 10 for p in place)
    for item in masked:
        assert not ((item.xy[:, 0] > 99.5) & (item.xy[:, 0] < 139.5)).any()
        assert len(item.ids) > 100


def test_ignore_of_another_size_is_refused() -> None:
    with pytest.raises(UsageError, match=r"320x200.*320x240"):
        run(warped(homographies(2)), ignore=np.zeros((200, 320), bool))


def test_a_jump_of_exposure_ends_few_tracks() -> None:
    maps = homographies(8)
    frames = warped(maps)
    for f in range(4, 8):
        frames[f] = picture(frames[f][:, :, 0] * 0.45 + 130)
    points = run(frames)
    kept = np.isin(points[3].ids, points[5].ids).mean()
    undisturbed = run(warped(maps))
    usual = np.isin(undisturbed[3].ids, undisturbed[5].ids).mean()
    assert kept > 0.8 * usual
    assert np.median(errors(dense(points), maps)) < 0.15


def test_tracks_end_where_one_surface_turns_into_another() -> None:
    """No step shows it: neighbouring frames are alike, the last and the first are not."""
    one, two = texture(WIDTH, HEIGHT, 12), texture(WIDTH, HEIGHT, 13)
    points = run([picture(one + (two - one) * f / 60) for f in range(61)])
    assert np.isin(points[0].ids, points[10].ids).mean() > 0.8
    assert np.isin(points[0].ids, points[-1].ids).mean() < 0.5, "98 % go on unchecked"


def test_two_tracks_that_meet_become_one() -> None:
    maps = []
    for f in range(40):
        zoom = 0.965**f
        middle = np.array([[zoom, 0, WIDTH / 2], [0, zoom, HEIGHT / 2], [0, 0, 1]])
        maps.append(middle @ np.array([[1, 0, -WIDTH], [0, 1, -HEIGHT], [0, 0, 1]]))
    points = run(warped(maps, blur=8.0))
    old = np.isin(points[-1].ids, points[0].ids)
    assert old.sum() > 5, "something must have come close"
    for item in points:
        apart = np.hypot(*(item.xy[:, None] - item.xy[None]).transpose(2, 0, 1)) + 1e9 * np.eye(len(item.ids))
        assert apart.min() > 1.2


def test_a_cut_ends_every_track() -> None:
    one, two = texture(WIDTH, HEIGHT, 7), texture(WIDTH, HEIGHT, 8)
    points = run([picture(one)] * 3 + [picture(two)] * 10)
    assert np.isin(points[2].ids, points[-1].ids).mean() < 0.02
    assert len(points[3].ids) > 100, "new ones are born in the very frame of the cut"


def test_repeated_frames_move_nothing() -> None:
    points = run([picture(texture(WIDTH, HEIGHT, 9))] * 12)
    np.testing.assert_allclose(points[-1].xy[: len(points[0].ids)], points[0].xy, atol=0.01)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (10, 300), (48, 48), (200, 40), (2600, 1460)])
def test_sizes_from_a_stamp_to_beyond_full_resolution(width: int, height: int) -> None:
    plane = texture(width + 8, height + 8, blur=max(1.5, width / 700))
    points = run([picture(plane[f : f + height, 2 * f : 2 * f + width]) for f in range(4)])
    if min(width, height) < 16:
        assert all(len(item.ids) == 0 for item in points)
        return
    tracks = dense(points)
    whole = tracks.visible.all(axis=0)
    assert whole.sum() > 5
    step = (tracks.xy[3] - tracks.xy[0])[whole]
    np.testing.assert_allclose(np.median(step, axis=0), (-6, -3), atol=0.15)


def test_window_and_levels_follow_the_picture() -> None:
    assert Search.for_picture(640, 360, 21) == (21, 3)
    assert Search.for_picture(1280, 720, 21) == (21, 4)
    assert Search.for_picture(48, 48, 21).window < 12


def test_the_window_is_as_wide_as_high_in_whole_lanes() -> None:
    assert Search.for_picture(1280, 720, 11).size == (8, 11)
    assert Search.for_picture(1280, 720, 21).size == (24, 21)
    assert Search.for_picture(48, 48, 11).size == (8, 9)
    assert Search.for_picture(640, 360, 5).size == (8, 5)


def test_klt_is_given_that_window_both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[tuple[int, int]] = []

    def spy(*args: Any, **kwargs: Any) -> Any:
        sizes.append(kwargs["winSize"])
        return calc(*args, **kwargs)

    calc = cv2.calcOpticalFlowPyrLK
    monkeypatch.setattr(cv2, "calcOpticalFlowPyrLK", spy)
    run(warped(homographies(2)))
    assert sizes == [(8, 11)] * 2


def test_points_go_where_they_go_with_the_error_that_opencv_tells_by_default(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def default(*args: Any, **kwargs: Any) -> Any:
        return calc(*args, **(kwargs | {"flags": 0}))

    frames = warped(homographies(8))
    calc, ours = cv2.calcOpticalFlowPyrLK, run(frames)
    monkeypatch.setattr(cv2, "calcOpticalFlowPyrLK", default)
    for a, b in zip(ours, run(frames), strict=True):
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_array_equal(a.xy, b.xy)


def test_a_window_higher_than_wide_follows_alike_both_ways() -> None:
    """The same plane, once as it is, once lying on its side."""
    off = []
    swap = np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1.0]])
    for side in (np.eye(3), swap):
        size = (WIDTH, HEIGHT) if side is not swap else (HEIGHT, WIDTH)
        plane, maps = texture(2 * WIDTH, 2 * HEIGHT), [side @ m for m in homographies(12)]
        frames = [picture(cv2.warpPerspective(plane, m, size, flags=cv2.INTER_CUBIC)) for m in maps]
        tracks = dense(run(frames))
        off.append(errors(tracks, maps))
        assert np.median(off[-1]) < 0.1
    assert len(off[1]) == pytest.approx(len(off[0]), rel=0.1)


def test_drift_check_measures_the_offset_and_sees_another_surface() -> None:
    plane = texture(400, 300, 10, blur=3)
    warp = np.array([[1.12, 0.1, 3], [-0.08, 1.06, 15]], np.float32)
    later = np.clip(cv2.warpAffine(plane, warp, (400, 300), flags=cv2.INTER_CUBIC) * 0.6 + 40, 0, 255)
    xy = np.random.default_rng(0).uniform(50, 240, (60, 2)).astype(np.float32)
    there = (xy @ warp[:, :2].T + warp[:, 2]).astype(np.float32)
    for shift in (0.0, 2.0):
        references = References.none(7)
        references.add(plane.astype(np.uint8), xy)
        slid = there + np.float32([shift, 0])
        verdict = references.check(later.astype(np.uint8), slid, np.arange(60))
        assert np.percentile(verdict.similarity, 5) > 0.97
        np.testing.assert_allclose(np.median(verdict.offset), shift, atol=0.1)
    elsewhere = References.none(7)
    elsewhere.add(plane.astype(np.uint8), xy)
    other = elsewhere.check(texture(400, 300, 11, blur=3).astype(np.uint8), there, np.arange(60))
    assert np.median(other.similarity) < 0.8


@pytest.mark.parametrize(
    "change",
    [
        {"max_points": 0},
        {"window": 20},
        {"birth_interval_s": 0.0},
        {"cells": 0},
        {"max_return_error": 0.0},
        {"quality": 1.0},
    ],
)
def test_configuration_out_of_range_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(UsageError, match=f"tracking.{next(iter(change))}"):
        TrackerConfig(**change)
