"""What is measured between two segments is what its name says."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.cues import CUES, Cues, Group
from ifsvideo.types import Tracks

FRAMES = 15
PIECE = 20
"""Points of each quarter of the scene: two pieces of one body, two of another."""
NOISE = 0.05


def body(points: int, turn: float, step: tuple[float, float], seed: int) -> np.ndarray:
    """A rigid body before an affine camera, about its middle: (F, P, 2)."""
    shape = np.random.default_rng(seed).uniform(-40, 40, (points, 3))
    angle = np.linspace(0, turn, FRAMES)
    ones, zeros = np.ones(FRAMES), np.zeros(FRAMES)
    rows = np.stack([np.cos(angle), zeros, np.sin(angle), zeros, ones, 0.3 * angle], axis=1)
    path = np.arange(FRAMES)[:, None, None] * np.array(step)
    return np.asarray(np.einsum("fij,pj->fpi", rows.reshape(FRAMES, 2, 3), shape) + path)


def bodies(scale: float = 1.0) -> Tracks:
    """Two bodies side by side: points 0-39 and 40-79."""
    one = body(2 * PIECE, 0.5, (1.0, 0.5), 0) + np.array([200, 200])
    other = body(2 * PIECE, -0.6, (-2.0, 1.0), 1) + np.array([320, 200])
    noise = np.random.default_rng(2).normal(0, NOISE, (FRAMES, 4 * PIECE, 2))
    return Tracks.from_array(scale * (np.concatenate([one, other], axis=1) + noise), size=(640, 480))


def measure(
    tracks: Tracks, unit: float = 1.0, evidence: np.ndarray | None = None
) -> tuple[Cues, list[Group]]:
    """The pieces of both bodies, each of one segment."""
    evidence = np.ones(tracks.points) if evidence is None else evidence
    cues = Cues(tracks, tracks.xy[0], evidence, np.zeros(tracks.points), unit, 10)
    pieces = [np.arange(k, k + PIECE) for k in range(0, tracks.points, PIECE)]
    return cues, cues.groups([(piece, piece) for piece in pieces])


def cue(name: str, cues: Cues, a: Group, b: Group) -> float:
    """One of the cues between two groups, its logarithm undone."""
    return float(np.exp(cues.between([(a, b)])[0, 4 + CUES.index(name)]))


def test_cross_prediction_is_small_inside_a_body_and_large_between_two() -> None:
    cues, pieces = measure(bodies())
    inside = [cue("rigid", cues, pieces[0], pieces[1]), cue("rigid", cues, pieces[2], pieces[3])]
    between = [cue("rigid", cues, pieces[i], pieces[j]) for i in (0, 1) for j in (2, 3)]
    assert max(inside) < 2  # as far off as segments' own points are
    assert min(between) > 10 * max(inside)


def test_a_turning_solid_is_rigid_but_no_affine_map_of_the_picture() -> None:
    cues, pieces = measure(bodies())
    assert cue("affine", cues, pieces[0], pieces[1]) > 5 * cue("rigid", cues, pieces[0], pieces[1])


def test_noise_is_that_of_the_segments_and_never_less_than_a_trackers() -> None:
    cues, pieces = measure(bodies())
    assert cues.noise == pytest.approx(NOISE * np.sqrt(2), rel=0.4)
    still = Tracks.from_array(np.repeat(bodies().xy[:1], FRAMES, axis=0))
    cues, pieces = measure(still, unit=2.0)
    assert cues.noise == pytest.approx(0.1)
    assert cue("rigid", cues, pieces[0], pieces[2]) < 0.01


def test_the_gap_is_the_least_distance() -> None:
    tracks = bodies()
    cues, pieces = measure(tracks, unit=2.0)
    first, second = tracks.xy[0, :PIECE], tracks.xy[0, 2 * PIECE : 3 * PIECE]
    least = np.linalg.norm(first[:, None] - second[None], axis=2).min()
    assert cue("gap", cues, pieces[0], pieces[2]) == pytest.approx(least / 2)


def test_shear_and_its_ratio_are_those_of_the_thesis() -> None:
    tracks = bodies()
    cues, pieces = measure(tracks)
    a, b = pieces[0].members, pieces[2].members
    between = shear.score(tracks, shear.between_edges(tracks.xy[0], a, b, 10))
    inside = [shear.score(tracks, shear.inside_edges(tracks.xy[0], part)) for part in (a, b)]
    assert cue("shear", cues, pieces[0], pieces[2]) == pytest.approx(between)
    assert cue("shear_ratio", cues, pieces[0], pieces[2]) == pytest.approx(between / (sum(inside) / 2))


def test_evidence_is_the_median_of_the_reliable_points() -> None:
    tracks = bodies()
    evidence = np.full(tracks.points, 100.0)
    evidence[:10], evidence[40:60] = 3.0, 0.5
    cues = Cues(tracks, tracks.xy[0], evidence, np.zeros(tracks.points), 1.0, 10)
    found = cues.groups([(np.arange(40), np.arange(10)), (np.arange(40, 60), np.arange(40, 60))])
    assert [group.evidence for group in found] == [3.0, 0.5]
    for pair in ((found[0], found[1]), (found[1], found[0])):
        assert np.exp(cues.between([pair])[0, :4]) == pytest.approx([3.0, 0.5] * 2)  # no world that yields
        assert (cue("larger", cues, *pair), cue("smaller", cues, *pair)) == pytest.approx((20, 10))


def test_the_order_of_two_segments_does_not_matter() -> None:
    tracks = bodies()
    cues = Cues(tracks, tracks.xy[0], np.ones(tracks.points), np.zeros(tracks.points), 1.0, 10)
    parts = [np.arange(25), np.arange(25, 40), np.arange(40, 65), np.arange(65, 80)]
    groups = cues.groups([(part, part) for part in parts])
    pairs = [(a, b) for k, a in enumerate(groups) for b in groups[k + 1 :]]
    assert cues.between(pairs) == pytest.approx(cues.between([(b, a) for a, b in pairs]))


def test_pairs_are_measured_together_as_by_themselves() -> None:
    cues, pieces = measure(bodies())
    pairs = [(pieces[0], pieces[1]), (pieces[1], pieces[3]), (pieces[2], pieces[3])]
    assert cues.between(pairs) == pytest.approx(np.concatenate([cues.between([pair]) for pair in pairs]))
    assert cues.between([]).shape == (0, 4 + len(CUES))


def test_a_larger_picture_of_the_same_measures_the_same() -> None:
    """All but shear, which adds radians to pixels as the thesis does."""
    small, large = (measure(bodies(scale), unit=scale) for scale in (1.0, 3.0))
    for name in ("rigid", "affine", "gap", "larger", "smaller"):
        one, other = (cue(name, cues, pieces[0], pieces[2]) for cues, pieces in (small, large))
        assert one == pytest.approx(other, rel=1e-3), name


def test_merged_groups_are_measured_as_one() -> None:
    cues, pieces = measure(bodies())
    merged = cues.merge(pieces[:2])
    whole = cues.group(np.arange(2 * PIECE), np.arange(2 * PIECE))
    assert merged.members.tolist() == list(range(2 * PIECE))
    assert (merged.inside, merged.evidence) == (whole.inside, whole.evidence)
    assert merged.rigid == pytest.approx(whole.rigid)


def test_sets_that_are_merged_together_are_measured_as_one_by_one() -> None:
    cues, pieces = measure(bodies())
    sets = [pieces[:2], pieces[2:], pieces[1:], pieces[:1]]
    fresh, own = measure(bodies())
    for together, parts in zip(cues.merge_each(sets), ([0, 1], [2, 3], [1, 2, 3], [0]), strict=True):
        alone = fresh.merge([own[part] for part in parts])
        assert together.members.tolist() == alone.members.tolist()
        assert together.inside == pytest.approx(alone.inside)
        assert together.rigid == pytest.approx(alone.rigid)
        assert together.affine == pytest.approx(alone.affine)


def test_large_segments_are_measured_by_some_of_their_points() -> None:
    tracks = Tracks.from_array(np.random.default_rng(0).uniform(0, 99, (5, 300, 2)))
    cues = Cues(tracks, tracks.xy[0], np.ones(300), np.zeros(tracks.points), 1.0, 10)
    (group,) = cues.groups([(np.arange(300), np.arange(100, 300))])
    assert 50 <= len(group.sample) <= 60
    assert np.isin(group.sample, group.reliable).all()
    assert group.rigid.shape == (300,)


def test_segments_never_seen_together_take_the_usual_shear() -> None:
    xy = bodies().xy.copy()
    xy[:8, :PIECE] = np.nan
    xy[8:, 2 * PIECE :] = np.nan
    tracks = Tracks.from_array(xy)
    anchor = np.nanmean(xy, axis=0)
    cues = Cues(tracks, anchor, np.ones(tracks.points), np.zeros(tracks.points), 1.0, 10)
    groups = cues.groups([(part, part) for part in (np.arange(PIECE), np.arange(2 * PIECE, 4 * PIECE))])
    insides = [group.inside for group in groups]
    assert cues.typical_inside == pytest.approx(np.median(insides))
    assert cue("shear", cues, *groups) == pytest.approx(cues.typical_inside)


def test_single_points_have_finite_cues() -> None:
    tracks = bodies()
    cues = Cues(tracks, tracks.xy[0], np.zeros(tracks.points), np.zeros(tracks.points), 1.0, 10)
    parts = [np.array([0]), np.array([50]), np.arange(10, 30)]
    groups = cues.groups([(part, part) for part in parts])
    assert np.isnan(groups[0].inside)
    pairs = [(groups[0], groups[1]), (groups[1], groups[2])]
    assert np.isfinite(cues.between(pairs)).all()


def test_depth_is_what_parts_two_groups_over_what_spreads_them() -> None:
    tracks = bodies()
    nearness = np.concatenate([np.linspace(0.1, 0.2, 40), np.linspace(0.5, 0.7, 40)])
    cues = Cues(tracks, tracks.xy[0], np.zeros(80), nearness, 1.0, 10)
    (one, other) = cues.groups([(part, part) for part in (np.arange(40), np.arange(40, 80))])
    low, middle, high = other.depth
    assert (low, middle, high) == pytest.approx((0.52, 0.6, 0.68))
    spread = 0.8 * 0.1 + 0.8 * 0.2 + 0.02 * 0.6 + 0.001
    assert cue("depth", cues, one, other) == pytest.approx(0.45 / spread + 0.1)
    assert cue("depth", cues, one, one) == pytest.approx(0.1)


def test_another_world_measures_nothing_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    cues, pieces = measure(bodies())
    before = cues.between([(pieces[0], pieces[2])])
    moved = cues.in_world(cues.evidence, cues.nearness)
    monkeypatch.setattr(shear, "totals", None)  # by which all are measured
    pieces = moved.groups([(group.members, group.reliable) for group in pieces])
    assert np.array_equal(moved.between([(pieces[0], pieces[2])]), before)


def test_another_world_changes_evidence_and_depth_alone() -> None:
    """What was measured before is what would be measured again."""
    tracks = bodies()
    rng = np.random.default_rng(3)
    cues, pieces = measure(tracks)
    before = cues.between([(pieces[0], pieces[2])])
    evidence, nearness = rng.uniform(0, 3, 80), rng.uniform(0, 1, 80)
    moved = cues.in_world(evidence, nearness)
    fresh = Cues(tracks, tracks.xy[0], evidence, nearness, 1.0, 10)
    parts = [(group.members, group.reliable) for group in pieces]
    for one in (moved, fresh):
        pieces = one.groups(parts)
        after = one.between([(pieces[0], pieces[2])])
        unchanged = [4 + k for k, name in enumerate(CUES) if name != "depth"]
        assert after[0, unchanged] == pytest.approx(before[0, unchanged])
        assert not np.isclose(after[0, [0, 1, 4 + CUES.index("depth")]], before[0, [0, 1, -1]]).any()
    assert moved.between([(pieces[0], pieces[3])]) == pytest.approx(fresh.between([(pieces[0], pieces[3])]))
