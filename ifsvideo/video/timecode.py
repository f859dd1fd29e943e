"""Times as people write them."""

from __future__ import annotations

import re

from ifsvideo.errors import UsageError

_TIME = re.compile(r"(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d*)?|\.\d+)", re.ASCII)


def parse_time(text: str) -> float:
    """Seconds from ``62.5``, ``1:02.5`` or ``0:01:02.5``.

    Parameters
    ----------
    text : str
        ``[[hours:]minutes:]seconds``; the seconds may have decimals.

    Returns
    -------
    float
        Seconds, not negative.

    Raises
    ------
    UsageError
        If the text is no such time, is negative or not a number, or a part after a colon reaches 60.
    """
    match = _TIME.fullmatch(text.strip())
    if match is None:
        raise UsageError(f"{text!r} is not a time; write seconds (62.5) or minutes and seconds (1:02.5)")
    hours, minutes, seconds = (float(part or 0) for part in match.groups())
    if (match[2] and seconds >= 60) or (match[1] and minutes >= 60):
        raise UsageError(f"{text!r} is not a time; minutes and seconds after a colon stay below 60")
    return 3600 * hours + 60 * minutes + seconds
