"""The peers: they recover motions made from an affine camera, and refuse what they cannot do."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.benchmark import datasets, metrics
from ifsvideo.benchmark.peers import PEERS, PeerFactory
from ifsvideo.benchmark.peers.base import by_size
from ifsvideo.benchmark.peers.spectral import k_means, leading
from ifsvideo.benchmark.peers.ssc import SparseSubspaceClustering, strongest
from ifsvideo.errors import UsageError
from ifsvideo.segmentation.shape_interaction import normalised
from ifsvideo.types import UNDECIDED, Tracks
from tests.scenes import SIZE, affine_motions

HOPKINS = Path(__file__).resolve().parents[2] / "shared" / "datasets" / "hopkins155"
EVERY_PEER = pytest.mark.parametrize("name", sorted(PEERS))


# In five dimensions three subspaces of four share much of what they span: RANSAC's published weakness.
@pytest.mark.parametrize(
    ("name", "sizes", "wrong"),
    [
        ("ransac", (60, 40), 2),
        ("ssc", (60, 40), 0),
        ("ssc", (50, 40, 30), 0),
        ("rsim", (60, 40), 0),
        ("rsim", (50, 40, 30), 0),
    ],
)
def test_recovers_independent_motions(name: str, sizes: tuple[int, ...], wrong: int) -> None:
    tracks, truth = affine_motions(sizes)
    found = PeerFactory(name)(0).segment(tracks, len(sizes))
    # Largest first: the very numbers, not only the partition.
    assert (found.labels != truth).sum() <= wrong
    assert (found.background == (found.labels == 0)).all()


@EVERY_PEER
def test_refuses_without_the_number(name: str) -> None:
    tracks, _ = affine_motions()
    with pytest.raises(UsageError, match="number of motions"):
        PEERS[name]().segment(tracks)
    with pytest.raises(ValueError, match="at least 1"):
        PEERS[name]().segment(tracks, 0)


@EVERY_PEER
def test_incomplete_tracks_stay_undecided(name: str) -> None:
    whole, truth = affine_motions()
    visible = whole.visible.copy()
    gaps = np.array([0, 7, 50])
    visible[[0, 5, -1], gaps] = False
    found = PEERS[name]().segment(Tracks.from_array(whole.xy, visible, size=SIZE), 2)
    decided = np.setdiff1d(np.arange(whole.points), gaps)
    assert (found.labels[gaps] == UNDECIDED).all()
    assert not found.background[gaps].any()
    assert (found.confidence[gaps] == 0).all()
    assert metrics.error(found.labels[decided], truth[decided] + 1) <= 2.5


@EVERY_PEER
def test_same_seed_same_labels(name: str) -> None:
    tracks, _ = affine_motions(noise=6.0)
    factory = pickle.loads(pickle.dumps(PeerFactory(name)))
    first, second = (factory(3).segment(tracks, 2).labels for _ in range(2))
    assert (first == second).all()


def test_ransac_depends_on_the_seed() -> None:
    tracks, _ = affine_motions(noise=6.0)
    labels = [PEERS["ransac"](seed).segment(tracks, 2).labels for seed in range(5)]
    assert any((one != labels[0]).any() for one in labels)


@EVERY_PEER
def test_one_motion_is_all_background(name: str) -> None:
    tracks, _ = affine_motions()
    assert (PEERS[name]().segment(tracks, 1).labels == 0).all()


@EVERY_PEER
@pytest.mark.parametrize(("sizes", "frames"), [((5, 4), 15), ((60, 40), 2)])
def test_too_little_to_tell(name: str, sizes: tuple[int, ...], frames: int) -> None:
    tracks, _ = affine_motions(sizes, frames)
    assert (PEERS[name]().segment(tracks, 2).labels == UNDECIDED).all()


@EVERY_PEER
@pytest.mark.parametrize("spread", [0.0, 100.0])
def test_points_that_stand_still(name: str, spread: float) -> None:
    # Neither points that coincide nor subspaces of less than four dimensions may stop a benchmark.
    place = 200 + spread * np.random.default_rng(0).random((1, 30, 2))
    labels = PEERS[name]().segment(Tracks.from_array(np.repeat(place, 10, axis=0)), 2).labels
    assert set(labels) <= {0, 1}


@pytest.mark.parametrize(("name", "limit"), [("ransac", 12.0), ("ssc", 1.0), ("rsim", 1.0)])
def test_real_sequences(name: str, limit: float) -> None:
    if not HOPKINS.is_dir():
        pytest.skip("Hopkins-155 is not here")
    errors = [
        metrics.error(PEERS[name]().segment(one.tracks, one.motions).labels, one.truth)
        for one in datasets.load("hopkins155", HOPKINS, "cars2_*")
    ]
    assert np.mean(errors) <= limit


def test_by_size() -> None:
    assert by_size(np.array([2, 0, 1, 1, 1, 0])).tolist() == [2, 1, 0, 0, 0, 1]
    assert by_size(np.array([1, 0])).tolist() == [1, 0]


def test_strongest_keeps_the_share() -> None:
    column = np.array([[0.1], [-0.6], [0.3], [0.0]])
    assert strongest(column, 0.5).ravel().tolist() == [0, -0.6, 0, 0]
    assert strongest(column, 0.7).ravel().tolist() == [0, -0.6, 0.3, 0]
    assert strongest(column, 1.0).ravel().tolist() == column.ravel().tolist()


def test_sparse_coefficients() -> None:
    tracks, truth = affine_motions()
    Y = normalised(tracks)
    C = SparseSubspaceClustering().coefficients(Y)
    own = np.abs(C)[truth[:, None] == truth].sum()
    assert (np.diag(C) == 0).all()
    assert np.abs(C.sum(axis=0) - 1).max() < 0.01
    assert np.linalg.norm(Y - Y @ C) < 0.05 * np.linalg.norm(Y)
    assert (C != 0).mean() < 0.3
    assert own > 0.95 * np.abs(C).sum()


def test_leading_eigenvalues_count_the_blocks() -> None:
    blocks = np.kron(np.eye(3), np.ones((5, 5)))
    values, vectors = leading(blocks, 4)
    np.testing.assert_allclose(values, [1, 1, 1, 0], atol=1e-12)
    assert vectors.shape == (15, 4)


def test_k_means_finds_clouds() -> None:
    rng = np.random.default_rng(0)
    truth = rng.integers(0, 4, 80)
    points = np.array([[0, 0], [5, 0], [0, 5], [9, 9]])[truth] + rng.normal(scale=0.3, size=(80, 2))
    assert metrics.error(k_means(points, 4, rng), truth + 1) == 0
