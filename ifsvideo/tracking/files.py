"""Tracks from files: NumPy's ``.npz``, and the ``.mat`` layouts of Hopkins-155 and KT3DMoSeg."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from ifsvideo.errors import InputError
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import Tracks

_FIELDS = ("xy", "visible", "ids", "size", "fps", "frame", "track", "frames")
LAYOUTS = "xy (F, P, 2) in .npz; y (3, P, F), or the struct Data with ySparse (3, P, F), in .mat"


def load_tracks(path: str | Path) -> Tracks:
    """Read tracks from a file.

    Parameters
    ----------
    path : str or Path
        ``.npz`` with ``xy`` (F, P, 2) pixels, NaN where not seen, and optionally ``visible`` (F, P),
        ``ids`` (P,), integers, each once, ``size`` (width, height) of the picture, ``fps``. Or, as
        `ifsvideo.output.tracks_npz` writes long clips, a row for each track and frame in which it is seen:
        ``frame``, ``track``, ``xy`` (N, 2), and ``frames``, how many there are. Or ``.mat``: Hopkins-155
        (``y`` (3, P, F) homogeneous pixels, ``width``, ``height``), or KT3DMoSeg (the struct ``Data`` with
        ``ySparse`` (3, P, F) and ``visibleSparse`` (P, F); all visible where that is missing).

    Raises
    ------
    InputError
        If the file is missing or damaged, or holds something else.
    """
    found = _load(Path(path))
    return found if isinstance(found, Tracks) else found.window(0, found.frames)


def load_trajectories(path: str | Path) -> Trajectories:
    """The same as `load_tracks` reads, but never as larger arrays than those of the file.

    Raises
    ------
    InputError
        As `load_tracks`.
    """
    found = _load(Path(path))
    return found if isinstance(found, Trajectories) else Trajectories.from_tracks(found)


def _load(file: Path) -> Tracks | Trajectories:
    if not file.is_file():
        raise InputError(f"{file}: no such file; give a .npz or .mat file of tracks")
    ending = file.suffix.lower()
    try:
        if ending == ".npz":
            tracks: Tracks | Trajectories = _from_npz(file)
        elif ending == ".mat":
            tracks = _from_mat(loadmat(file))
        else:
            raise InputError(f"not a file of tracks; give {LAYOUTS}")
    except InputError as fault:
        raise InputError(f"{file}: {fault}") from fault
    except NotImplementedError as fault:
        raise InputError(f"{file}: is a MATLAB 7.3 file; save it with '-v7'") from fault
    except OSError as fault:
        raise InputError(f"{file}: cannot be read ({fault.strerror or fault}); check the file") from fault
    except Exception as fault:  # damaged files make the readers raise nearly anything
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise InputError(
            f"{file}: is damaged or not of its ending's kind ({reason}); write it anew"
        ) from fault
    points = tracks.points if isinstance(tracks, Tracks) else len(np.unique(tracks.ids))
    if tracks.frames == 0 or points == 0:
        raise InputError(f"{file}: holds {points} tracks over {tracks.frames} frames; give at least one")
    return tracks


def _from_npz(file: Path) -> Tracks | Trajectories:
    content = _arrays(file)
    if "xy" not in content:
        raise InputError(f"has no field xy, only {', '.join(content) or 'nothing'}; give {LAYOUTS}")
    xy = _numbers(content["xy"], "xy")
    size, fps = _told(content)
    if xy.ndim == 2 and "track" in content:
        return _from_rows(content, xy, size, fps)
    if xy.ndim != 3 or xy.shape[2] != 2:
        raise InputError(f"xy has shape {xy.shape}; give (frames, tracks, 2)")
    visible = content.get("visible")
    if visible is not None and visible.shape != xy.shape[:2]:
        raise InputError(f"visible has shape {visible.shape}; give {xy.shape[:2]} as xy has")
    return Tracks.from_array(xy, visible, _checked_ids(content.get("ids"), xy.shape[1]), size, fps)


def _arrays(file: Path) -> dict[str, NDArray[Any]]:
    """What is looked at of the arrays of an archive; of others only the name."""
    # A stream of our own: numpy leaves the file open where it finds the archive damaged.
    with file.open("rb") as stream:
        content = np.load(stream, allow_pickle=False)
        if isinstance(content, np.ndarray):
            raise InputError("holds a single array; write it by numpy.savez(file, xy=array)")
        return {name: content[name] if name in _FIELDS else np.empty(0) for name in content}


def _told(content: Mapping[str, NDArray[Any]]) -> tuple[tuple[int, int] | None, float | None]:
    """Size of the picture and frames per second, where the archive tells them."""
    size, fps = content.get("size"), content.get("fps")
    if size is not None and (size.shape != (2,) or not (size >= 1).all()):
        raise InputError(f"size is {size.tolist()}; give width and height of the picture, pixels")
    if fps is not None and (fps.shape != () or not 0 < fps < np.inf):
        raise InputError(f"fps is {fps.tolist()}; give one positive number")
    sides = None if size is None else (int(size[0]), int(size[1]))
    return sides, None if fps is None else float(fps)


def _from_rows(
    content: Mapping[str, NDArray[Any]],
    xy: NDArray[np.float64],
    size: tuple[int, int] | None,
    fps: float | None,
) -> Trajectories:
    """A row for every track and frame in which it is seen."""
    missing = [name for name in ("frame", "frames") if name not in content]
    if missing:
        raise InputError(f"has rows but no {' and no '.join(missing)}; give frame, track, xy, frames")
    frame, track = content["frame"], content["track"]
    for name, column in (("frame", frame), ("track", track)):
        if column.shape != xy.shape[:1] or not np.issubdtype(column.dtype, np.integer):
            raise InputError(f"{name} is {column.dtype} of shape {column.shape}; give {len(xy)} integers")
    frames = int(content["frames"])
    if xy.shape[1:] != (2,) or not np.isfinite(xy).all():
        raise InputError(f"xy of rows has shape {xy.shape} or is not finite; give (rows, 2)")
    if len(frame) and not (frame[0] >= 0 and frame[-1] < frames and (np.diff(frame) >= 0).all()):
        raise InputError(f"frame does not rise from 0 to {frames - 1}; order the rows by it")
    return Trajectories(
        frame.astype(np.int32), track.astype(np.int64), xy.astype(np.float32), frames, size, fps
    )


def _checked_ids(ids: NDArray[Any] | None, points: int) -> NDArray[Any] | None:
    if ids is None:
        return None
    if ids.shape != (points,) or not np.issubdtype(ids.dtype, np.integer):
        raise InputError(
            f"ids is {ids.dtype} of shape {ids.shape}; give {points} integers, one for each track"
        )
    if len(np.unique(ids)) < points:
        raise InputError("ids names a track twice; give each its own")
    return ids


def _from_mat(content: Mapping[str, Any]) -> Tracks:
    if "y" in content:
        size = None
        if "width" in content and "height" in content:
            size = int(content["width"].item()), int(content["height"].item())
        return Tracks.from_array(_frames_first(content["y"], "y"), size=size)
    data = content.get("Data")
    names = getattr(getattr(data, "dtype", None), "names", None) or ()
    if data is None or "ySparse" not in names:
        fields = [name for name in content if not name.startswith("__")]
        raise InputError(
            f"has neither y nor Data.ySparse, only {', '.join(fields) or 'nothing'}; give {LAYOUTS}"
        )
    xy = _frames_first(data["ySparse"].item(), "Data.ySparse")
    if "visibleSparse" not in names:
        return Tracks.from_array(xy)
    visible = np.asarray(data["visibleSparse"].item())
    if visible.shape != (xy.shape[1], xy.shape[0]):
        raise InputError(f"Data.visibleSparse has shape {visible.shape}; give {(xy.shape[1], xy.shape[0])}")
    return Tracks.from_array(xy, visible.T != 0)


def _frames_first(homogeneous: Any, name: str) -> NDArray[np.float64]:
    """(3, P, F) homogeneous coordinates as (F, P, 2); a .mat file drops a last axis of one."""
    points = _numbers(homogeneous, name)
    if points.ndim == 2:
        points = points[:, :, None]
    if points.ndim != 3 or points.shape[0] != 3:
        raise InputError(f"{name} has shape {points.shape}; give (3, tracks, frames)")
    return np.ascontiguousarray(points[:2].transpose(2, 1, 0))


def _numbers(array: Any, name: str) -> NDArray[np.float64]:
    values = np.asarray(array)
    if not (np.issubdtype(values.dtype, np.floating) or np.issubdtype(values.dtype, np.integer)):
        raise InputError(f"{name} holds {values.dtype}, not numbers; give coordinates in pixels")
    return values.astype(np.float64)
