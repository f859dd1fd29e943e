"""Tracks by their ids in order, against numpy's own functions."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.ordered import places


@pytest.mark.parametrize("count", [0, 1, 200])
@pytest.mark.parametrize("others", [0, 1, 200])
def test_places_are_where_ids_are(count: int, others: int) -> None:
    rng = np.random.default_rng(count + others)
    ids, among = rng.permutation(300)[:count], np.sort(rng.permutation(300)[:others])
    place, there = places(ids, among)
    np.testing.assert_array_equal(there, np.isin(ids, among))
    np.testing.assert_array_equal(among[place[there]], ids[there])
