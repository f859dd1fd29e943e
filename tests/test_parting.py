"""Motions of an object and of the ground, from tracks whose motions are known."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.objects.parting import NODES, Motions, how_far_parted, lags
from ifsvideo.objects.silhouette import View

SIZE = (400, 300)


def scene(own: int = 30, ground: int = 200, seed: int = 0):
    """Tracks of an object in a box, and of the ground round it."""
    rng = np.random.default_rng(seed)
    on = rng.uniform([150, 100], [250, 200], (own, 2))
    off = rng.uniform([0, 0], SIZE, (8 * ground, 2))
    off = off[((off < [145, 95]) | (off > [255, 205])).any(axis=1)][:ground]
    xy = np.concatenate([on, off]).astype(np.float32)
    return xy, np.arange(len(xy)) < own


def motions(
    xy: np.ndarray, own: np.ndarray, ground: np.ndarray | None = None, guessed: np.ndarray | None = None
) -> tuple[Motions, View]:
    view = View.around(np.array([[150, 100], [250, 200]], np.float32), 0.2, 10.0, SIZE)
    none = np.zeros(len(xy), bool)
    return Motions(
        view, xy, own, ~own if ground is None else ground, none if guessed is None else guessed, 1.0
    ), view


def test_both_motions_are_found_among_wrong_tracks() -> None:
    """The object grows and turns, the ground shears; one track in six goes elsewhere."""
    xy, own = scene()
    grows, shears = np.array([[1.05, -0.02], [0.02, 1.05]]), np.array([[1.0, 0.01], [0.0, 1.0]])
    there = np.where(own[:, None], (xy - 200) @ grows.T + 206, xy @ shears.T - 2)
    there[::6] += (20, -15)
    told, view = motions(xy, own)
    with_object, with_ground = told.to(there.astype(np.float32))
    nodes = view.nodes(NODES, NODES)
    middle = np.s_[6:19]
    true_object = ((nodes - 200) @ grows.T + 206 - nodes).reshape(NODES, NODES, 2)
    assert np.abs(with_object - true_object).reshape(-1, 2)[middle].max() < 0.7
    true_ground = (nodes @ shears.T - 2 - nodes).reshape(NODES, NODES, 2)
    assert np.median(np.abs(with_ground - true_ground)) < 0.5


def test_few_tracks_of_an_object_go_together() -> None:
    xy, own = scene(own=4)
    there = xy + np.where(own[:, None], (5.0, 1.0), (0.0, 0.0))
    with_object, with_ground = motions(xy, own)[0].to(there.astype(np.float32))
    assert with_object == pytest.approx(np.broadcast_to((5.0, 1.0), with_object.shape), abs=1e-4)
    assert not with_ground.any()


def test_tracks_that_are_not_seen_there_do_not_count() -> None:
    xy, own = scene()
    there = (xy + np.where(own[:, None], (5.0, 1.0), (-1.0, 0.0))).astype(np.float32)
    there[np.random.default_rng(1).random(len(xy)) < 0.5] = np.nan
    with_object, with_ground = motions(xy, own)[0].to(there)
    assert with_object == pytest.approx(np.broadcast_to((5.0, 1.0), with_object.shape), abs=1e-3)
    assert with_ground == pytest.approx(np.broadcast_to((-1.0, 0.0), with_ground.shape), abs=1e-3)


def test_guessed_tracks_that_go_along_with_the_object_do_not_tell_how_the_ground_moves() -> None:
    """Half of an object's tracks are too short for a window to decide of, and were guessed to be ground."""
    xy, on = scene(own=60)
    own = on & (np.arange(len(xy)) % 2 == 0)
    there = (xy + np.where(on[:, None], (5.0, 1.0), (-1.0, 0.0))).astype(np.float32)
    beside = np.random.default_rng(2).random(len(xy)) < 0.5
    for guessed, right in ((~own & (on | beside), True), (~own & beside & ~on, False)):
        _, with_ground = motions(xy, own, ~own, guessed)[0].to(there)
        off = np.abs(with_ground - (-1.0, 0.0)).max(axis=2)
        assert bool((off < 0.1).all()) == right


def test_where_most_guesses_go_along_the_object_is_the_ground() -> None:
    """All that is near goes along: it counts, and nothing parts."""
    xy, own = scene()
    there = xy + np.float32([5.0, 1.0])
    far = ~own & ((xy < [30, 20]) | (xy > [370, 280])).any(axis=1)
    there[far] = xy[far]
    flows = motions(xy, own, ~own, ~own & ~far)[0].to(there)
    assert how_far_parted(*flows) < 0.1


def test_too_few_tracks_tell_nothing() -> None:
    for own, ground, known in ((2, 200, False), (3, 200, True), (30, 7, False)):
        assert motions(*scene(own, ground))[0].known == known
    xy, own = scene(3, 200)
    told, _ = motions(xy, own)
    there = xy.copy()
    there[0] = np.nan
    assert told.to(there) is None
    there = np.where(own[:, None], xy, np.nan).astype(np.float32)
    assert told.to(there) is None


def test_a_ground_that_is_far_off_tells_nothing() -> None:
    xy, own = scene()
    near = own | ((xy < [60, 40]) | (xy > [340, 260])).any(axis=1)
    view = View.around(np.array([[190, 140], [210, 160]], np.float32), 0.2, 10.0, SIZE)
    xy, own, none = xy[near], own[near], np.zeros(np.count_nonzero(near), bool)
    assert not Motions(view, xy, own, ~own, none, 1.0).known
    assert Motions(view, xy, own, ~own, none, 4.0).known


def test_how_far_two_motions_part() -> None:
    still = np.zeros((NODES, NODES, 2), np.float32)
    assert how_far_parted(still + np.float32([3.0, 4.0]), still) == pytest.approx(5.0)


def test_times_in_frames() -> None:
    assert lags(30.0, (1 / 30, 0.1, 0.11)) == (1, 3)
    assert lags(1.0, (0.01, 0.2)) == (1,)
