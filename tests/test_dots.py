"""Dots: where they are said to be, as large, as opaque; at the border, and where they overlap."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.output.dots import draw_dots

COLOUR = (200, 100, 40)


def drawn(xy, radius=3.0, opacity=1.0, size=(40, 30), ground=0) -> np.ndarray:
    canvas = np.full((size[1], size[0], 3), ground, np.uint8)
    draw_dots(canvas, np.asarray(xy, np.float32).reshape(-1, 2), radius, COLOUR, opacity)
    return canvas.astype(int)


def share(*args, **options) -> np.ndarray:
    """How much of each pixel is covered (H, W)."""
    return drawn(*args, **options)[..., 0] / COLOUR[0]


@pytest.mark.parametrize("radius", [1.1, 2.07, 4.5, 11.0])
@pytest.mark.parametrize("x", [20.0, 20.3, 20.5, 20.999])
def test_a_dot_lies_at_its_point_and_is_as_large_as_told(radius, x):
    y = 14.75
    cover = share([[x, y]], radius)
    rows, columns = np.indices(cover.shape)
    assert cover.sum() == pytest.approx(np.pi * radius**2, rel=0.1 if radius < 2 else 0.03)
    assert np.average(columns, weights=cover) == pytest.approx(x, abs=0.05)
    assert np.average(rows, weights=cover) == pytest.approx(y, abs=0.05)
    distance = np.hypot(columns - x, rows - y)
    assert (cover[distance < radius - 0.5] == 1).all()
    assert (cover[distance > radius + 0.5] == 0).all()


def test_a_dot_has_its_colour_and_lets_through_what_lies_below():
    assert (drawn([[20, 15]])[15, 20] == COLOUR).all()
    below = np.full(3, 80)
    mixed = 0.25 * np.array(COLOUR) + 0.75 * below
    assert drawn([[20, 15]], opacity=0.25, ground=80)[15, 20] == pytest.approx(mixed, abs=1)
    assert (drawn([[20, 15]], opacity=0.25, ground=80)[0, 0] == below).all()


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_dots_that_overlap_are_one_area(opacity):
    """Neither darker nor hollow where they meet, in whichever order they come."""
    xy = np.array([[18.2, 15.0], [21.7, 15.4], [20.1, 18.3], [20.1, 18.3]])
    each = np.max([share([point], opacity=opacity) for point in xy], axis=0)
    for order in (slice(None), slice(None, None, -1)):
        np.testing.assert_allclose(share(xy[order], opacity=opacity), each, atol=0.04)


@pytest.mark.parametrize(
    "point", [(0, 0), (-0.49, 12), (39.49, 29.49), (20, 29), (-2.2, 5), (39.2, -2.9), (-30, 50), (90, 3)]
)
def test_a_dot_at_the_border_is_cut_off_there(point):
    wide = share([np.add(point, 60)], size=(160, 150))
    np.testing.assert_allclose(share([point]), wide[60:90, 60:100], atol=0.02)


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (200, 3)])
def test_a_dot_may_be_larger_than_the_picture(size):
    assert (drawn([[0, 0]], 20.0, size=size)[:3, :3] == COLOUR).all()


def test_no_points_leave_the_picture_as_it_is():
    assert (drawn(np.empty((0, 2)), ground=80) == 80).all()
