"""The outline that parts what looks like an object from what looks like ground, where the picture has edges.

What is minimised is GrabCut's energy (Rother et al., GrabCut, SIGGRAPH 2004) on four neighbours: how badly
colours fit, and where neighbours are parted, how alike they look. Its minimum is that of a weighted total
variation, found by steps that go up in flows and down in pixels (Chambolle and Pock, A first-order primal-
dual algorithm, JMIV 2011): array operations alone, and from a start in half the rows and columns few of them.
OpenCV's GrabCut finds it exactly, on eight neighbours, and takes more than twice as long.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools, Image

_SMOOTH = 100.0
"""Cost of an outline between two pixels that look alike, in logarithms of likelihood: in the mean over
directions outlines are as dear as by GrabCut's 50 on eight neighbours."""
_DECIDED = 5.0
"""Evidence, in costs of an outline, of a pixel that is told: more than its four neighbours can outweigh."""
_STEPS = (60, 120)
"""Steps in half, and in all of the rows and columns: the last make outlines exact, the first a good start.
With others a soft shadow that goes along may stay with the object (`ifsvideo/benchmark/TRIED.md`)."""
_LEARN = 2
"""Of so many rows and columns one is taken to learn colours: as exact, in a third of the time."""
_GREY = 1.0
"""Variance, grey levels squared, added to colours: no colour is more exact than a picture's whole numbers."""

Floats = NDArray[np.float32]
"""Of pixels (R, C) the evidence, or the share of the object. To the next pixel of the row and of the column
(2, R, C) what it costs to part them, 0 where there is none, or the flow."""


def cut(picture: Image, likely: Bools, sure: NDArray[np.int8]) -> Bools:
    """Whether each pixel (R, C) belongs to the object.

    Parameters
    ----------
    picture : (R, C, 3) uint8
    likely : (R, C) bool
        From which pixels to learn the object's colours, and from which not True the ground's; neither none.
    sure : (R, C) int8
        1 where the object is told, -1 where the ground is, 0 elsewhere.
    """
    rows, columns = likely.shape
    colours = np.ascontiguousarray(picture.reshape(-1, 3).T, np.float32) - np.float32(128)
    fit = _fit(picture, likely, colours).reshape(likely.shape) / np.float32(_SMOOTH)
    # Even numbers of rows and columns at each size.
    whole = 2 ** (len(_STEPS) - 1)
    evidence = np.zeros((-(-rows // whole) * whole, -(-columns // whole) * whole), np.float32)
    evidence[:rows, :columns] = np.where(sure == 0, fit, _DECIDED * sure)
    costs = np.zeros((2, *evidence.shape), np.float32)
    _set_costs(colours.reshape(3, rows, columns), costs[:, :rows, :columns])
    return np.asarray(least(evidence, costs)[:rows, :columns], bool)


def least(evidence: Floats, costs: Floats) -> Bools:
    """Which pixels (R, C) to call the object's, so that the costs where two are parted, less the evidence of
    these pixels, are about as small as can be.

    Parameters
    ----------
    evidence : (R, C) float32
        For the object; negative for the ground.
    costs : (2, R, C) float32
        At most 1. R and C are multiples of two to the number of coarser sizes.
    """
    sizes = [(np.clip(evidence, -_DECIDED, _DECIDED), costs)]
    for _ in _STEPS[1:]:
        sizes.append(_coarser(*sizes[-1]))
    flow = np.zeros_like(sizes[-1][1])
    share = (sizes[-1][0] > 0).astype(np.float32)
    for steps, (here, bounds) in zip(_STEPS, reversed(sizes), strict=True):
        if bounds.shape != flow.shape:
            flow = _finer(flow, here, bounds)
            share = np.repeat(np.repeat(share, 2, axis=0), 2, axis=1)
        flow, share = _approach(here, bounds, flow, share, steps)
    return np.asarray(share > 0.5, bool)


def _approach(
    evidence: Floats, bounds: Floats, flow: Floats, share: Floats, steps: int
) -> tuple[Floats, Floats]:
    """Flow and share of the object in each pixel, so many steps nearer to the best."""
    columns = evidence.shape[1]
    # In a row of all pixels the next of the row is one away and that of the column a row; no flow goes over
    # the end of a row. Shares count half, which spares the flow's step of a half.
    here, most = evidence.ravel(), bounds.reshape(2, -1)
    flows, now = flow.reshape(2, -1), share.ravel() * np.float32(0.5)
    low, ahead, change = -most, now.copy(), np.zeros_like(flows)
    along, down = change[0, :-1], change[1, :-columns]
    following = np.empty_like(now)
    for _ in range(steps):
        np.subtract(ahead[:-1], ahead[1:], out=along)
        np.subtract(ahead[:-columns], ahead[columns:], out=down)
        flows += change
        np.minimum(flows, most, out=flows)
        np.maximum(flows, low, out=flows)
        _left(here, flows, columns, following)
        # A quarter of the half: with the flow's step the largest for which this converges.
        following *= np.float32(0.125)
        following += now
        np.minimum(following, np.float32(0.5), out=following)
        np.maximum(following, np.float32(0), out=following)
        np.subtract(following, now, out=ahead)
        ahead += following
        now, following = following, now
    return flows.reshape(flow.shape), (2 * now).reshape(share.shape)


def _left(evidence: Floats, flows: Floats, columns: int, out: Floats) -> None:
    """Evidence (N,) that flows (2, N) leave in each of all pixels in a row."""
    np.subtract(evidence, flows[0], out=out)
    out -= flows[1]
    out[1:] += flows[0, :-1]
    out[columns:] += flows[1, :-columns]


def _coarser(evidence: Floats, costs: Floats) -> tuple[Floats, Floats]:
    """The same, if each 2x2 pixels go together; in twice the unit, so that no cost is larger than 1."""
    rows = evidence[::2] + evidence[1::2]
    together = np.clip((rows[:, ::2] + rows[:, 1::2]) / 2, -_DECIDED, _DECIDED)
    along = costs[0, ::2, 1::2] + costs[0, 1::2, 1::2]
    down = costs[1, 1::2, ::2] + costs[1, 1::2, 1::2]
    return np.asarray(together, np.float32), np.asarray(np.stack([along, down]) / 2, np.float32)


def _finer(coarse: Floats, evidence: Floats, bounds: Floats) -> Floats:
    """Flow in pixels half as large: between 2x2 pixels as it was, within so that it leaves all alike."""
    along, down = np.clip(coarse / np.maximum(_coarser(evidence, bounds)[1], 1e-6), -1, 1)
    flow = np.zeros_like(bounds)
    for k in (0, 1):
        flow[0, k::2, 1::2] = along * bounds[0, k::2, 1::2]
        flow[1, 1::2, k::2] = down * bounds[1, 1::2, k::2]
    left = np.empty_like(evidence)
    _left(evidence.ravel(), flow.reshape(2, -1), evidence.shape[1], left.ravel())
    a, b, c, d = left[::2, ::2], left[::2, 1::2], left[1::2, ::2], left[1::2, 1::2]
    across, upright, both = (a - b + c - d) / 4, (a + b - c - d) / 4, (a - b - c + d) / 8
    flow[0, ::2, ::2], flow[0, 1::2, ::2] = across + both, across - both
    flow[1, ::2, ::2], flow[1, ::2, 1::2] = upright + both, upright - both
    return np.asarray(np.clip(flow, -bounds, bounds), np.float32)


def _set_costs(colours: Floats, costs: Floats) -> None:
    """What it costs to part neighbours in colours (3, R, C): 1 where they are alike."""
    along, down = colours[:, :, 1:] - colours[:, :, :-1], colours[:, 1:] - colours[:, :-1]
    apart = [np.einsum("crk,crk->rk", step, step) for step in (along, down)]
    mean = sum(float(each.sum()) for each in apart) / max(1, sum(each.size for each in apart))
    costs[0, :, :-1] = np.exp(apart[0] / np.float32(-2 * max(mean, 1e-6)))
    costs[1, :-1] = np.exp(apart[1] / np.float32(-2 * max(mean, 1e-6)))


def _fit(picture: Image, likely: Bools, colours: Floats) -> Floats:
    """Logarithm (N,) of how likely colours (3, N), pixels less 128, are the object's over the ground's."""
    some = likely[::_LEARN, ::_LEARN]
    every = 1 if some.all() or not some.any() else _LEARN
    mask = np.where(likely[::every, ::every], cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    models = np.zeros((2, 1, 65))
    # It draws the first centres of its colours at random. With no iterations it learns and does not cut.
    cv2.setRNGSeed(0)
    shown = np.ascontiguousarray(picture[::every, ::every])
    cv2.grabCut(shown, mask, (0, 0, 1, 1), models[0], models[1], 0, cv2.GC_INIT_WITH_MASK)
    products = np.empty((10, colours.shape[1]), np.float32)
    np.multiply(colours, colours, out=products[:3])
    np.multiply(colours[:2], colours[2], out=products[3:5])
    np.multiply(colours[0], colours[1], out=products[5])
    products[6:9] = colours
    products[9] = 1
    ground, figure = (np.max(_terms(model[0]) @ products, axis=0) for model in models)
    return np.asarray(figure - ground, np.float32)


def _terms(model: NDArray[np.floating[Any]]) -> Floats:
    """Logarithms of the likelihoods (K, 10) of a GrabCut model's colours: their parts of xx, yy, zz, xz, yz,
    xy, x, y, z, and what is constant."""
    used = model[:5] > 0
    shares, means = model[:5][used], model[5:20].reshape(5, 3)[used] - 128
    spread = model[20:].reshape(5, 3, 3)[used] + _GREY * np.eye(3)
    exact = np.linalg.inv(spread)
    middle = np.einsum("kij,kj->ki", exact, means)
    constant = np.log(shares) - 0.5 * (np.log(np.linalg.det(spread)) + (middle * means).sum(axis=1))
    squares = -0.5 * np.diagonal(exact, axis1=1, axis2=2)
    mixed = -exact[:, [0, 1, 0], [2, 2, 1]]
    return np.column_stack([squares, mixed, middle, constant]).astype(np.float32)
