"""Simulated windows: what they promise, and that the camera and the movers obey geometry."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ifsvideo.benchmark.simulation import Box, Camera, Simulation, simulate, simulate_window

SEEDS = range(60)


@pytest.fixture(scope="module")
def windows() -> list[Simulation]:
    return [simulate_window(seed) for seed in SEEDS]


def movers(window: Simulation) -> np.ndarray:
    """True labels of the movers."""
    truth = window.sequence.truth
    return np.unique(truth[truth > 1])


def test_the_seed_says_everything() -> None:
    one, again, other = simulate(7), simulate(7), simulate(8)
    np.testing.assert_array_equal(one.tracks.xy, again.tracks.xy)
    np.testing.assert_array_equal(one.truth, again.truth)
    assert one.name == again.name != other.name
    assert one.tracks.xy.shape != other.tracks.xy.shape


def test_labels_have_no_gap_and_every_group_has_tracks(windows: list[Simulation]) -> None:
    for window in windows:
        truth = window.sequence.truth
        counts = np.bincount(truth)
        assert (counts[1:] > 0).all()
        assert counts[1] >= 30
        assert (counts[2:] >= 5).all()
        assert counts[2:].max(initial=0) <= 150
        assert 0 <= counts[0] <= 0.06 * len(truth)


def test_windows_are_as_long_and_as_full_as_promised(windows: list[Simulation]) -> None:
    for window in windows:
        tracks = window.sequence.tracks
        assert 20 <= tracks.frames <= 30
        assert tracks.fps is not None
        assert 25 <= tracks.fps <= 30
        assert 200 <= tracks.points <= 1000
        assert (tracks.visible.sum(axis=0) >= tracks.frames / 2).all()
        starts = np.diff(tracks.visible.astype(int), axis=0, prepend=0) == 1
        assert (starts.sum(axis=0) == 1).all(), "a track that died came back"


def test_what_is_visible_is_in_the_picture(windows: list[Simulation]) -> None:
    for window in windows:
        tracks = window.sequence.tracks
        assert tracks.size is not None
        seen = tracks.xy[tracks.visible]
        assert (seen >= 0).all()
        assert (seen <= np.array(tracks.size) - 1).all()
        assert np.isnan(tracks.xy[~tracks.visible]).all()


def test_about_a_third_have_no_mover_and_every_kind_occurs(windows: list[Simulation]) -> None:
    none = np.mean([len(movers(window)) == 0 for window in windows])
    assert 0.2 < none < 0.46
    assert {window.sequence.kind for window in windows} == {"road", "rest", "hand-held", "sideways"}
    assert {len(movers(window)) for window in windows} >= {0, 1, 2, 3}


def test_the_static_world_stands_and_movers_leave_where_they_were(windows: list[Simulation]) -> None:
    for window in windows:
        truth, tracks = window.sequence.truth, window.sequence.tracks
        static = window.places[:, truth == 1]
        np.testing.assert_array_equal(static, np.broadcast_to(static[0], static.shape))
        for label in movers(window):
            mine = np.flatnonzero(truth == label)
            first = tracks.visible[:, mine].argmax(axis=0)
            stood = np.broadcast_to(window.places[first, mine], window.places[:, mine].shape)
            gap = np.linalg.norm(window.scene.camera.project(stood) - window.exact[:, mine], axis=2)
            largest = np.where(tracks.visible[:, mine] & np.isfinite(gap), gap, 0).max(axis=0)
            assert np.median(largest) >= 3


def test_a_mover_stays_rigid(windows: list[Simulation]) -> None:
    for window in windows:
        for label in movers(window):
            places = window.places[:, window.sequence.truth == label]
            distances = np.linalg.norm(places - places[:, :1], axis=2)
            np.testing.assert_allclose(distances, np.broadcast_to(distances[0], distances.shape), atol=1e-9)


def test_noise_is_that_of_a_tracker(windows: list[Simulation]) -> None:
    for window in windows:
        error = (window.sequence.tracks.xy - window.exact)[:, window.sequence.truth > 0]
        assert 0.04 < np.nanmedian(np.abs(error)) < 0.4
        spread = np.nanstd(error, axis=(0, 2))
        assert np.mean(spread > 0.6) < 0.1


def test_one_perspective_camera_path_explains_a_static_scene() -> None:
    """The camera of each frame is found again from known places and noise-free pixels, lens left out."""
    window = next(w for w in map(simulate_window, SEEDS) if not len(movers(w)) and w.sequence.kind == "road")
    camera, static = window.scene.camera, np.flatnonzero(window.sequence.truth == 1)
    for frame in (0, 9, 19):
        seen = static[window.sequence.tracks.visible[frame, static]]
        places, pixels = window.places[frame, seen], window.exact[frame, seen]
        middle = (np.array(camera.size) - 1) / 2
        bent = (pixels - middle) / camera.focal

        def misses(pose: np.ndarray, places: np.ndarray = places, bent: np.ndarray = bent) -> np.ndarray:
            own = Rotation.from_rotvec(pose[:3]).apply(places) + pose[3:]
            plane = own[:, :2] / own[:, 2:]
            return (plane * (1 + camera.k1 * (plane**2).sum(axis=1, keepdims=True)) - bent).ravel()

        start = np.zeros(6)
        start[3:] = -camera.centres[frame] + 0.05
        found = least_squares(misses, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14).x
        rotation = Rotation.from_rotvec(found[:3]).as_matrix()
        np.testing.assert_allclose(misses(found), 0, atol=1e-7)
        np.testing.assert_allclose(-rotation.T @ found[3:], camera.centres[frame], atol=1e-3)


@pytest.mark.parametrize("k1", [-0.2, 0.0, 0.05])
def test_rays_undo_the_projection(k1: float) -> None:
    rng = np.random.default_rng(1)
    turns = Rotation.from_rotvec(rng.normal(0, 0.2, (3, 3))).as_matrix()
    camera = Camera((640, 480), 700.0, k1, turns, rng.normal(size=(3, 3)))
    xy = rng.uniform(0, 479, (50, 2))
    places = camera.centres[1] + 7 * camera.rays(1, xy)
    np.testing.assert_allclose(camera.project(places)[1], xy, atol=1e-6)


def test_a_ray_enters_a_turned_box_where_its_face_is() -> None:
    box = Box(np.array([1.0, 1.0, 2.0]), np.array([[0.0, 0.0, 10.0]]), np.array([np.pi / 2]))
    origins, directions = (
        np.zeros((1, 1, 3)),
        np.array([[[0.0, 0, 1], [0.19, 0, 1], [0.3, 0, 1], [0, 0, -1]]]),
    )
    np.testing.assert_allclose(box.entry(origins, directions)[0], [9, 9, np.inf, np.inf])


def test_nothing_is_seen_through_a_mover(windows: list[Simulation]) -> None:
    checked = 0
    for window in windows:
        truth, visible = window.sequence.truth, window.sequence.tracks.visible
        static = truth == 1
        centres = window.scene.camera.centres[:, None]
        for box in window.scene.boxes:
            if box.moves:
                enters = box.entry(centres, window.places[:, static] - centres)
                assert not ((enters < 1 - 1e-6) & visible[:, static]).any()
                checked += int((enters < 1).sum())
    assert checked > 0, "no mover ever covered a track: the test shows nothing"


def test_seeds_differ_in_lens_and_size(windows: list[Simulation]) -> None:
    lenses = {round(window.scene.camera.k1, 6) for window in windows}
    assert len(lenses) > 0.8 * len(windows)
    assert all(a.scene.camera.focal != b.scene.camera.focal for a, b in pairwise(windows))
    assert len({window.scene.camera.size for window in windows}) >= 6
