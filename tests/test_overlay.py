from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from ifsvideo.config import OverlayConfig
from ifsvideo.output import hull
from ifsvideo.output.legend import clock, draw_legend, draw_number
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.palette import BACKGROUND_COLOUR, BACKGROUND_TRAIL, ink_on, label_colour, object_colour
from ifsvideo.output.scenes import Scenes
from ifsvideo.types import FramePoints, Scene, VideoInfo

NO_LEGEND = OverlayConfig(legend=False)


def scene(xy, labels, trail=None) -> Scene:
    xy = np.asarray(xy, np.float32).reshape(-1, 2)
    trail = xy[None] if trail is None else np.asarray(trail, np.float32)
    return Scene(3, 1.5, np.arange(len(xy)), xy, np.asarray(labels, np.int32), trail)


def grey(width: int = 320, height: int = 180, value: int = 120) -> np.ndarray:
    return np.full((height, width, 3), value, np.uint8)


def near(image: np.ndarray, x: int, y: int, colour, tolerance: int = 40) -> bool:
    return bool((np.abs(image[y, x].astype(int) - colour) <= tolerance).all())


def test_picture_is_not_changed_and_size_and_type_are_kept():
    image = grey()
    before = image.copy()
    out = OverlayRenderer().draw(image, scene([[50, 60], [60, 70], [70, 60]], [1, 1, 1]))
    assert out.shape == image.shape
    assert out.dtype == np.uint8
    np.testing.assert_array_equal(image, before)


def test_background_is_subdued_and_an_object_is_lit():
    out = OverlayRenderer(NO_LEGEND).draw(
        grey(), scene([[100, 60], [180, 60], [180, 140], [100, 140]], [1] * 4)
    )
    assert 60 < out[10, 300].mean() < 110
    assert out[100, 140].mean() > out[10, 300].mean() + 15


def test_every_point_wears_the_colour_of_its_label():
    xy = [[40, 40], [150, 90], [250, 130]]
    out = OverlayRenderer(NO_LEGEND).draw(grey(1280, 720), scene(np.array(xy) * 4, [0, 1, 2]))
    for (x, y), label in zip(xy, (0, 1, 2), strict=True):
        assert near(out, 4 * x, 4 * y, label_colour(label), 40 if label else 70)


def test_subpixel_position_is_kept():
    centres = []
    for x in (50.0, 50.25, 50.5):
        out = OverlayRenderer(NO_LEGEND).draw(grey(), scene([[x, 50.0]], [0])).astype(float)
        dot = np.abs(out - out[0, 0]).sum(axis=(0, 2))
        centres.append(np.average(np.arange(len(dot)), weights=dot))
    np.testing.assert_allclose(centres, [50.0, 50.25, 50.5], atol=0.06)


@pytest.mark.parametrize("size", [(48, 48), (320, 180), (1280, 720), (1, 1), (5000, 20)])
@pytest.mark.parametrize("legend", [True, False])
def test_any_size_and_no_points(size, legend):
    empty = scene(np.empty((0, 2)), [], np.empty((1, 0, 2)))
    out = OverlayRenderer(OverlayConfig(legend=legend)).draw(grey(*size), empty)
    assert out.shape == (size[1], size[0], 3)


def test_points_outside_or_nowhere_are_left_out():
    image = grey()
    nowhere = [[-50, 20], [5000, 5000], [np.nan, 3], [np.inf, 2], [1e30, -1e30]]
    trail = np.stack([np.array(nowhere, np.float32)] * 2)
    renderer = OverlayRenderer(NO_LEGEND)
    np.testing.assert_array_equal(
        renderer.draw(image, scene(nowhere, [1, 1, 0, -1, 2], trail)),
        renderer.draw(image, scene(np.empty((0, 2)), [], np.empty((1, 0, 2)))),
    )


def test_a_trail_from_far_outside_is_drawn():
    trail = np.array([[[1e12, -1e12]], [[100, 100]]])
    out = OverlayRenderer(NO_LEGEND).draw(grey(), scene([[100, 100]], [1], trail))
    assert out.shape == (180, 320, 3)


def test_hundreds_of_objects_on_a_tiny_picture():
    rng = np.random.default_rng(0)
    labels = np.repeat(np.arange(1, 301), 3)
    out = OverlayRenderer().draw(grey(48, 48), scene(rng.uniform(0, 47, (900, 2)), labels))
    assert out.shape == (48, 48, 3)


def test_trail_leads_to_the_point_and_fades():
    xs = np.linspace(40, 600, 13)
    trail = np.stack([[[x, 200.0]] for x in xs])
    image = grey(1280, 720, 60)
    out = OverlayRenderer(NO_LEGEND).draw(image, scene([[600, 200]], [1], trail))
    strength = [np.abs(out[200, x].astype(int) - out[400, x]).sum() for x in (100, 300, 520)]
    assert 10 < strength[0] < strength[1] < strength[2]


def test_trail_has_gaps_where_the_point_was_not_seen():
    trail = np.stack([[[x, 200.0]] for x in np.linspace(40, 600, 7)])
    trail[3] = np.nan
    out = OverlayRenderer(NO_LEGEND).draw(grey(1280, 720, 60), scene([[600, 200]], [1], trail))
    assert (out[200, 320] == out[400, 320]).all()
    assert (out[200, 520] != out[400, 520]).any()
    assert (out[:150, :500] == out[0, 0]).all()


def test_a_trail_lets_through_the_picture_below_each_of_its_parts():
    """The oldest over red, the others over blue: none takes the other's colour."""
    image = grey(1280, 720, 0)
    image[:, :227, 0] = image[:, 227:, 2] = 200
    trail = np.stack([[[x, y] for y in (200, 500)] for x in np.linspace(40, 600, 7)])
    out = OverlayRenderer(NO_LEGEND).draw(image, scene(trail[-1], [0, 0], trail)).astype(int)
    for x, opacity in ((120, 0.25), (320, 0.46), (500, 0.85)):
        beside = out[400, x]
        wanted = opacity * (BACKGROUND_TRAIL - beside)
        for y in (200, 500):
            # A thin line does not cover the pixels below it entirely.
            cover = (out[y, x] - beside) @ wanted / (wanted @ wanted)
            assert 0.75 < cover < 1.02
            np.testing.assert_allclose(out[y, x], beside + cover * wanted, atol=2)


def test_a_trail_of_less_than_the_dot_is_not_drawn():
    still = np.array([[[100.2, 90.1]], [[100.0, 90.3]], [[100.0, 90.0]]])
    renderer = OverlayRenderer(NO_LEGEND)
    np.testing.assert_array_equal(
        renderer.draw(grey(), scene(still[-1], [1], still)), renderer.draw(grey(), scene(still[-1], [1]))
    )


def test_a_slow_trail_has_no_gaps():
    """Though each of its parts is shorter than a pixel."""
    xs = np.linspace(100, 110, 26)
    trail = np.stack([[[x, 90.0]] for x in xs])
    config = OverlayConfig(legend=False, style="trails")
    out = OverlayRenderer(config).draw(grey(), scene(trail[-1], [1], trail))
    assert (out[90, 101:111] != out[0, 0]).any(axis=1).all()


def test_sizes_follow_the_picture():
    covered = []
    for width, height in ((640, 360), (2560, 1440)):
        image = grey(width, height)
        square = np.array([[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]) * (width, height)
        out = OverlayRenderer(NO_LEGEND).draw(image, scene(square, [1] * 4))
        covered.append((out != out[0, 0]).any(axis=2).mean())
    assert covered[0] == pytest.approx(covered[1], rel=0.15)


def test_one_stray_point_does_not_stretch_the_hull():
    rng = np.random.default_rng(1)
    cluster = rng.uniform(100, 140, (20, 2))
    polygons = hull.outlines(np.vstack([cluster, [[1000, 700]]]), reach=60, margin=10)
    assert len(polygons) == 1
    assert polygons[0].max() < 160


@pytest.mark.parametrize(
    "xy", [[[50, 50]], [[50, 50], [60, 50]], [[50, 50]] * 3, [[10, 10], [20, 20], [30, 30], [40, 40]]]
)
def test_few_or_collinear_points_have_an_outline(xy):
    xy = np.array(xy, float)
    polygons = hull.outlines(xy, reach=30, margin=5)
    assert len(polygons) == 1
    np.testing.assert_allclose(polygons[0].min(axis=0), xy.min(axis=0) - 5, atol=0.1)
    np.testing.assert_allclose(polygons[0].max(axis=0), xy.max(axis=0) + 5, atol=0.1)


def test_two_clumps_have_an_outline_each():
    clump = np.random.default_rng(2).uniform(0, 30, (10, 2))
    assert len(hull.outlines(np.vstack([clump, clump + 400]), reach=60, margin=5)) == 2


def test_colours_of_the_first_objects_differ_clearly():
    colours = [object_colour(label) for label in range(1, 29)] + [BACKGROUND_COLOUR]
    assert len(set(colours)) == 29
    for one, other in itertools.combinations(colours[:7], 2):
        assert np.abs(np.subtract(one, other)).sum() > 80
    assert object_colour(29) == object_colour(1)


def test_ink_is_read_on_every_colour():
    for label in range(1, 29):
        colour = object_colour(label)
        assert abs(np.mean(ink_on(colour)) - np.dot(colour, [0.299, 0.587, 0.114])) > 80


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0:00.00"), (62.5, "1:02.50"), (59.999, "1:00.00"), (3600, "1:00:00.00")]
)
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_legend_stays_in_its_corner_and_can_be_left_out():
    empty = scene(np.empty((0, 2)), [], np.empty((1, 0, 2)))
    with_legend = OverlayRenderer().draw(grey(640, 360), empty)
    without = OverlayRenderer(NO_LEGEND).draw(grey(640, 360), empty)
    rows, columns = np.nonzero((with_legend != without).any(axis=2))
    assert len(rows) > 100
    assert rows.max() < 50
    assert columns.max() < 250


def test_legend_is_left_out_where_there_is_no_room():
    canvas = grey(12, 12)
    draw_legend(canvas, 1.0, 3, 2, 8)
    np.testing.assert_array_equal(canvas, grey(12, 12))


def test_scenes_follow_a_track_back_in_time():
    xy = np.arange(10, dtype=np.float32).reshape(5, 2)
    scenes = Scenes(VideoInfo(10, 10, Fraction(10), start=2.0), trail_s=0.2)

    def after(ids, rows, labels) -> Scene:
        return scenes.next(FramePoints(np.array(ids, np.int64), xy[rows]), np.array(labels, np.int32))

    first = after([4, 7], slice(0, 2), [0, 1])
    after([7], slice(2, 3), [1])
    found = after([4, 7], slice(3, 5), [0, 1])
    assert found.time_s == pytest.approx(2.2)
    np.testing.assert_array_equal(found.labels, [0, 1])
    expected = [[[0, 1], [2, 3]], [[np.nan, np.nan], [4, 5]], [[6, 7], [8, 9]]]
    np.testing.assert_array_equal(found.trails, expected)
    assert np.isnan(first.trails[:2]).all()
    assert after([], slice(0), []).trails.shape == (3, 0, 2)


def test_a_renderer_cannot_change_the_trails_of_later_scenes():
    scenes = Scenes(VideoInfo(10, 10, Fraction(10)), trail_s=0.2)
    points = FramePoints(np.array([4], np.int64), np.ones((1, 2), np.float32))
    scene = scenes.next(points, np.zeros(1, np.int32))
    with pytest.raises(ValueError, match="read-only"):
        scene.trails[:] = 0


@pytest.mark.parametrize("trail", [0, 1, 4])
def test_trails_of_tracks_that_end_and_come_back(trail):
    """A trail is where its track was in each of the last frames, whatever happened in between."""
    rng = np.random.default_rng(3)
    scenes = Scenes(VideoInfo(10, 10, Fraction(10)), trail_s=trail / 10)
    where = np.full((40, 30, 2), np.nan, np.float32)
    for frame in range(40):
        ids = np.flatnonzero(rng.random(30) < (0.0 if frame in (20, 21) else 0.6))
        where[frame, ids] = rng.uniform(0, 9, (len(ids), 2))
        points = FramePoints(ids.astype(np.int64), where[frame, ids])
        found = scenes.next(points, np.zeros(len(ids), np.int32)).trails
        past = np.full((trail + 1, len(ids), 2), np.nan, np.float32)
        known = where[max(0, frame - trail) : frame + 1, ids]
        past[len(past) - len(known) :] = known
        np.testing.assert_array_equal(found, past)


def test_numbers_keep_clear_of_the_legend_and_of_each_other():
    canvas = grey(640, 360)
    taken = draw_legend(canvas, 1.0, 3, 4, 9)
    assert len(taken) == 1
    for number in (1, 2, 3):
        taken.append(draw_number(canvas, number, (30.0, 40.0), (0, 90, 200), 9, taken))
    for one, other in itertools.combinations(taken, 2):
        assert one[3] <= other[1] or other[3] <= one[1] or one[2] <= other[0] or other[2] <= one[0]
