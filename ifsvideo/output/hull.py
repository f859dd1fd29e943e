"""The soft outline round the points of one object."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

SUBPIXEL_BITS = 4
"""Fractional bits of the coordinates given to OpenCV's drawing functions."""

_FAR = 30000.0
_NEIGHBOURS = 8
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
_MASK_DIAGONAL = 480.0


def fixed_point(xy: Floats) -> NDArray[np.int32]:
    """Coordinates for OpenCV's ``shift=SUBPIXEL_BITS``; what is very far off is brought nearer."""
    near = np.clip(np.asarray(xy), -_FAR, _FAR)
    return np.round(near * (1 << SUBPIXEL_BITS)).astype(np.int32)


def outlines(xy: Floats, reach: float, margin: float) -> list[NDArray[np.float32]]:
    """Rounded convex outlines of the groups that the points form, largest group first.

    Points are linked where they are nearer than ``reach``, or than four times the usual distance between
    neighbours, so that one stray point does not pull the outline over the picture: groups of one point, or
    of less than a tenth of all, are left out, unless there is no other.

    Parameters
    ----------
    xy : (N, 2) float, pixels, finite
    reach : float
        Distance that is always bridged, pixels.
    margin : float
        Space between the outermost points and the outline, pixels.

    Returns
    -------
    list of (K, 2) float32
        Corners of closed polygons, pixels.
    """
    if len(xy) == 0:
        return []
    group = groups(xy, reach)
    sizes = np.bincount(group)
    kept = np.flatnonzero(sizes >= max(2.0, 0.1 * len(xy)))
    if len(kept) == 0:
        kept = np.arange(len(sizes))
    order = kept[np.argsort(-sizes[kept], kind="stable")]
    return [_rounded_hull(xy[group == index], margin) for index in order]


def groups(xy: Floats, reach: float) -> NDArray[np.intp]:
    """Number (N,) of the group of each point (N, 2), linked as `outlines` says; N is at least 1."""
    count = min(_NEIGHBOURS, len(xy) - 1)
    if count < 1:
        return np.zeros(len(xy), dtype=np.intp)
    found = KDTree(xy).query(xy, k=count + 1)
    distance, neighbour = np.asarray(found[0]), np.asarray(found[1])
    bridged = max(reach, 4.0 * float(np.median(distance[:, 1])))
    near = np.asarray(distance <= bridged)
    ends = np.append(0, np.cumsum(near.sum(axis=1)))
    links = csr_array((np.ones(ends[-1]), neighbour[near], ends), shape=(len(xy), len(xy)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.intp)


def _rounded_hull(xy: Floats, margin: float) -> NDArray[np.float32]:
    """Convex hull of discs of radius ``margin`` round the points."""
    # Of the points only those of their own hull matter: to find them is quick, and the discs are few then.
    outermost = cv2.convexHull(np.asarray(xy, np.float32))
    discs = (outermost + margin * _CIRCLE).reshape(-1, 2).astype(np.float32)
    return np.asarray(cv2.convexHull(discs), dtype=np.float32).reshape(-1, 2)


def fill(
    canvas: Image, image: Image, polygons: Sequence[NDArray[np.float32]], colour: Colour, opacity: float
) -> None:
    """Light up the polygons on ``canvas``: ``image`` as it was, tinted, with a feathered edge."""
    for polygon in polygons:
        _fill_one(canvas, image, polygon, colour, opacity)


def _fill_one(
    canvas: Image, image: Image, polygon: NDArray[np.float32], colour: Colour, opacity: float
) -> None:
    height, width = canvas.shape[:2]
    # The mask is made small, since it is soft anyway: 4K then costs no more than its blending.
    scale = min(1.0, _MASK_DIAGONAL / float(np.hypot(width, height)))
    feather = 2
    pad = (3 * feather + 1) / scale
    left, top = np.maximum(np.floor(polygon.min(axis=0) - pad), 0).astype(int).tolist()
    right, bottom = np.minimum(np.ceil(polygon.max(axis=0) + pad), (width, height)).astype(int).tolist()
    if right <= left or bottom <= top:
        return
    small = np.zeros(
        (max(1, round((bottom - top) * scale)), max(1, round((right - left) * scale))), dtype=np.float32
    )
    per_pixel = (small.shape[1] / (right - left), small.shape[0] / (bottom - top))
    # Pixel centres: (x + 0.5) * scale - 0.5 on the smaller grid.
    corners = (polygon - (left, top) + 0.5) * per_pixel - 0.5
    cv2.fillConvexPoly(small, fixed_point(corners), (1.0,), cv2.LINE_8, SUBPIXEL_BITS)
    soft = cv2.GaussianBlur(small, (0, 0), feather, borderType=cv2.BORDER_REPLICATE)
    weight = cv2.resize(soft, (right - left, bottom - top), interpolation=cv2.INTER_LINEAR)
    tinted = np.column_stack([(1.0 - opacity) * np.eye(3), opacity * np.array(colour)])
    lit = cv2.transform(image[top:bottom, left:right], tinted)
    region = canvas[top:bottom, left:right]
    cv2.blendLinear(lit, region, weight, 1.0 - weight, dst=region)
