"""Looks vote whether tracks lie on objects."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.objects.votes import Votes


def voted(votes: dict[int, int], *, fps: float = 30.0, number: int = 1) -> Votes:
    """After so many looks at which each track lay on an object, or beside it if negative."""
    result = Votes(fps)
    for track, looks in votes.items():
        for _ in range(abs(looks)):
            result.cast(np.array([track]), number, np.array([looks > 0]))
    return result


def label(votes: Votes, before: int, *, guessed: bool, track: int = 7) -> int:
    return int(votes.corrected(np.array([track]), np.array([before]), np.array([guessed]))[0])


@pytest.mark.parametrize(("fps", "needed"), [(30.0, 1), (10.0, 2)])
@pytest.mark.parametrize("decided", [False, True])
def test_a_track_leaves_by_so_many_looks(fps: float, needed: int, decided: bool) -> None:
    """One of which a window has decided by one more, and so at a low rate."""
    for against in range(1, 4):
        votes = voted({7: -against}, fps=fps)
        votes.decide(np.array([7] if decided else []))
        assert label(votes, 1, guessed=not decided) == (against < needed + decided)


@pytest.mark.parametrize("fps", [30.0, 10.0])
def test_a_track_joins_by_so_many_looks(fps: float) -> None:
    """One that a window called background by one more; what is fixed to the camera does not."""
    for looks in range(3):
        votes = voted({7: looks}, fps=fps)
        assert label(votes, 0, guessed=True) == (looks >= 1)
        assert label(votes, -1, guessed=True) == (1 if looks >= 1 else -1)
        assert label(votes, 0, guessed=False) == (looks >= 2)
        assert label(votes, -1, guessed=False) == -1


def test_it_joins_the_object_on_which_it_lay_most_often() -> None:
    votes = voted({7: 2})
    for _ in range(3):
        votes.cast(np.array([7]), 2, np.array([True]))
    assert label(votes, 0, guessed=True) == 2


def test_looks_at_one_object_tell_nothing_of_another() -> None:
    votes = voted({7: -5})
    assert label(votes, 1, guessed=True) == 0
    assert label(votes, 2, guessed=True) == 2


@pytest.mark.parametrize("sign", [1, -1])
def test_a_track_is_told_once_one_look_more_changes_nothing(sign: int) -> None:
    """Neither by looks at another object."""
    votes = voted({track: sign * track for track in range(5)})
    votes.cast(np.array([9, 9, 9]), 2, np.ones(3, bool))
    assert votes.told(np.array([0, 1, 2, 3, 4, 9, 10]), 1).tolist() == [False] * 3 + [True] * 2 + [False] * 2
    for track in (3, 4):
        votes.cast(np.array([track]), 1, np.array([sign < 0]))
        assert label(votes, 1, guessed=True, track=track) == (1 if sign > 0 else 0)


def test_what_is_denied_leaves_whatever_was_seen_before() -> None:
    votes = voted({7: 5})
    votes.deny(np.array([7]), 1)
    assert label(votes, 0, guessed=True) == 0
    assert label(votes, 1, guessed=True) == 0


def test_a_track_that_has_ended_is_forgotten() -> None:
    votes = voted({1: -1, 2: -1, 3: 2, 4: 2})
    votes.forget(np.array([1, 3, 9]))
    corrected = votes.corrected(np.array([1, 2, 3, 4]), np.array([1, 1, -1, -1]), np.ones(4, bool))
    assert corrected.tolist() == [1, 0, -1, 1]
