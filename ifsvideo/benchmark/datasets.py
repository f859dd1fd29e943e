"""Loaders of the point data sets: tracks with a true label each."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from ifsvideo.errors import InputError, UsageError
from ifsvideo.types import Tracks

_KINDS = (
    ("checkerboard", r"\d+[RT]|three-cars"),
    ("traffic", r"cars|truck|kanatani[12](?!\d)"),
    ("articulated", r"arm|articulated|head|kanatani3(?!\d)|people|two_cranes"),
)
"""Kinds of Hopkins-155, by the start of the name."""


@dataclass(frozen=True)
class LabelledSequence:
    """Tracks whose motions are known.

    Attributes
    ----------
    name : str
    kind : str
        What a table groups by.
    tracks : Tracks
    truth : (P,) int64
        Group of each track from 1; 0 is not counted.
    """

    name: str
    kind: str
    tracks: Tracks
    truth: NDArray[np.int64]

    def __post_init__(self) -> None:
        if self.truth.shape != (self.tracks.points,):
            raise ValueError(f"expected labels of shape ({self.tracks.points},), got {self.truth.shape}")
        if not (self.truth > 0).any():
            raise ValueError("no point carries a true label")

    @property
    def motions(self) -> int:
        """Number of true groups, background included."""
        return len(np.unique(self.truth[self.truth > 0]))


def hopkins_kind(name: str) -> str:
    """Kind of a Hopkins-155 sequence: checkerboard, traffic, articulated, or "other" for a foreign name."""
    return next((kind for kind, pattern in _KINDS if re.match(pattern, name)), "other")


def load(dataset: str, folder: Path, only: str = "*") -> list[LabelledSequence]:
    """Load the sequences of a data set whose name fits a pattern, ordered by name.

    Parameters
    ----------
    dataset : {"hopkins155", "kt3dmoseg"}
    folder : Path
        Where the data set lies.
    only : str
        Shell pattern of the names.

    Raises
    ------
    InputError
        If the folder or a file cannot be read, or the folder holds no sequence.
    UsageError
        If no name fits the pattern.
    """
    pattern, suffix, reader = _LAYOUTS[dataset]
    files = dict(_named_files(folder, pattern, suffix))
    chosen = [name for name in sorted(files) if fnmatchcase(name, only)]
    if not chosen:
        raise UsageError(f"{folder}: no sequence is called {only}; there are {', '.join(sorted(files))}")
    return [_load_one(name, files[name], reader) for name in chosen]


def _named_files(folder: Path, pattern: str, suffix: str) -> Iterator[tuple[str, Path]]:
    """Yield name and file of each sequence; any name that occurs is taken."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that holds {pattern}")
    files = [file for file in folder.glob(pattern) if file.is_file()]
    if not files:
        raise InputError(f"{folder}: holds no {pattern}; give the data set's top folder")
    for file in files:
        yield file.name.removesuffix(suffix), file


def _load_one(name: str, file: Path, reader: Callable[[str, Path], LabelledSequence]) -> LabelledSequence:
    """Read one file; whatever is wrong with it becomes an `InputError` that names it."""
    try:
        return reader(name, file)
    except KeyError as fault:
        raise InputError(f"{file}: has no field {fault}; fetch the data set's own file again") from fault
    except Exception as fault:  # a damaged .mat file makes loadmat raise nearly anything
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise InputError(f"{file}: cannot be read ({reason}); fetch the file again") from fault


def _read_hopkins(name: str, file: Path) -> LabelledSequence:
    """``NAME/NAME_truth.mat``: y (3, P, F) homogeneous pixels, s (P, 1) groups, width, height."""
    fields = loadmat(file)
    size = (int(fields["width"].item()), int(fields["height"].item()))
    tracks = Tracks.from_array(_frames_first(fields["y"]), size=size)
    return LabelledSequence(name, hopkins_kind(name), tracks, fields["s"].ravel().astype(np.int64))


def _read_kt3dmoseg(name: str, file: Path) -> LabelledSequence:
    """``NAME_Tracks.mat``: the struct Data with ySparse (3, P, F), visibleSparse (P, F), GtLabel (P, 1)."""
    data = loadmat(file)["Data"][0, 0]
    fields = {field: data[field] for field in data.dtype.names}
    xy = _frames_first(fields["ySparse"])
    visible = None
    if "visibleSparse" in fields:
        visible = fields["visibleSparse"].reshape(xy.shape[1], -1).T != 0
    tracks = Tracks.from_array(xy, visible, size=_frame_size(file.parent / "OriginalSequences" / name))
    return LabelledSequence(name, "driving", tracks, fields["GtLabel"].ravel().astype(np.int64))


def _frames_first(homogeneous: NDArray[Any]) -> NDArray[np.float64]:
    """(3, P, F) homogeneous coordinates as (F, P, 2); a .mat file drops a last axis of one."""
    points = homogeneous.reshape(*homogeneous.shape[:2], -1)
    return np.ascontiguousarray(points[:2].transpose(2, 1, 0), dtype=np.float64)


def _frame_size(folder: Path) -> tuple[int, int] | None:
    """Width and height of the pictures in a folder, None where there are none."""
    pictures = sorted(file for file in folder.glob("*") if file.suffix.lower() in (".png", ".jpg", ".jpeg"))
    if not pictures:
        return None
    height, width = imageio.imread(pictures[0]).shape[:2]
    return int(width), int(height)


_LAYOUTS: dict[str, tuple[str, str, Callable[[str, Path], LabelledSequence]]] = {
    "hopkins155": ("*/*_truth.mat", "_truth.mat", _read_hopkins),
    "kt3dmoseg": ("*_Tracks.mat", "_Tracks.mat", _read_kt3dmoseg),
}
"""Pattern of the files, what follows the name, reader."""
