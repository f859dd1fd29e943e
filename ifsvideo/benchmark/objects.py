"""Runs the whole pipeline on the sample clips, and measures what is told of the objects."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark import samples, table
from ifsvideo.benchmark.object_truth import ObjectTruth, load_truth
from ifsvideo.benchmark.options import STATUS, add_config, add_only, add_runs, configuration, tell
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.objects.history import Event, ObjectHistory, ObjectTable
from ifsvideo.output.scenes import Scenes
from ifsvideo.types import Floats, FramePoints, Result

_HELP = """\
Run the whole pipeline on the sample clips, and measure boxes, times to contact and events.

DIR holds NAME.mp4, NAME_truth.npz and NAME_events.csv. An object is the one of the masks on which most of
its points lie. IoU: of its box with that of the mask, mean over the frames in which it is seen, 0 where the
mask is empty. Seen: per cent of the frames in which the mask has at least 200 pixels that have a box.

Contact, of an object that leaves the picture while it approaches, in its last two seconds there: told, per
cent of the frames in which it is seen that have a time; error, median of its difference from the true time,
in seconds and per cent; over limit, median of the difference divided by the larger of 0.3 s and 20 %. The
true time is that of the object's middle, if its speed stays. Away: frames with a time, in the whole clip, in
which the object's middle goes away.

Events: found, of those in the script, the ones told of the right object and kind within 0.5 s; extra, those
told that are not in the script; late, the largest difference of the found. Mean over runs; run r uses seed
S + r.
"""
_IN_VIEW = 200
"""Pixels of a mask from which on an object can be expected to be seen."""
_LAST_S = 2.0
_LEAST_ERROR_S, _LEAST_ERROR = 0.3, 0.2
"""An error of a time to contact that is still good: so many seconds, or so large a share of it."""
_PUNCTUAL_S = 0.5
"""How far off in time an event may be told."""


@dataclass(frozen=True)
class ObjectScore:
    """What is told of one true object; None where there is nothing to measure."""

    iou: float | None
    seen: float | None
    told: float | None
    error_s: float | None
    error_percent: float | None
    over_limit: float | None
    away: float


@dataclass(frozen=True)
class EventScore:
    """Events of one clip: in the script, found of them, told besides, largest difference in seconds."""

    true: float
    found: float
    extra: float
    late: float


@dataclass(frozen=True)
class ObjectsScore:
    """What a run told of a clip."""

    objects: dict[int, ObjectScore]
    events: EventScore


def replay(result: Result) -> ObjectHistory:
    """The history of the objects of a run, from its table."""
    history, scenes = ObjectHistory(result.info), Scenes(result.info, 0.0)
    for frame in range(result.table.frames):
        rows = result.table.at(frame)
        points = FramePoints(result.table.ids[rows], result.table.xy[rows])
        history.add(scenes.next(points, result.table.labels[rows]), None)
    history.finish()
    return history


def score(result: Result, truth: ObjectTruth) -> ObjectsScore:
    """Compare what is told of the objects with the truth."""
    history = replay(result)
    lies_on = samples.truth_of_rows(result.table, truth.masks)
    true_of = {}
    for number in history.table.numbers:
        counts = np.bincount(lies_on[result.table.labels == number], minlength=2)
        true_of[number] = int(counts[1:].argmax()) + 1 if counts[1:].any() else 0
    fps = float(result.info.fps)
    objects = {}
    for number in range(1, truth.boxes.shape[1] + 1):
        own = [label for label, true in true_of.items() if true == number]
        rows = history.table.select(np.isin(history.table.object, own))
        objects[number] = _score_object(rows, truth, number, fps)
    return ObjectsScore(objects, _score_events(history.events, true_of, truth))


def _score_object(rows: ObjectTable, truth: ObjectTruth, number: int, fps: float) -> ObjectScore:
    boxes, approach = truth.boxes[:, number - 1], truth.approach[:, number - 1]
    in_view = (truth.masks == number).sum(axis=(1, 2)) >= _IN_VIEW
    seen = np.isin(np.flatnonzero(in_view), rows.frame)
    told = np.isfinite(rows.ttc_s)
    rate = approach[rows.frame]
    shown = np.flatnonzero(in_view)
    leaves = len(shown) > 0 and shown[-1] < len(boxes) - 1 and approach[shown[-1]] > 0
    last = (rows.frame > shown[-1] - _LAST_S * fps) & (rows.frame <= shown[-1]) if leaves else told & False
    true = 1.0 / rate[last & told]
    error = np.abs(rows.ttc_s[last & told] - true)
    limit = np.maximum(_LEAST_ERROR_S, _LEAST_ERROR * true)
    return ObjectScore(
        iou=_mean(_overlap(rows, boxes[rows.frame])),
        seen=_mean(100.0 * seen),
        told=_mean(100.0 * told[last]) if leaves else None,
        error_s=_median(error),
        error_percent=_median(100.0 * error / true),
        over_limit=_median(error / limit),
        away=float((told & (rate <= 0)).sum()),
    )


def _overlap(rows: ObjectTable, boxes: Floats) -> NDArray[np.float64]:
    """Intersection over union (N,) of the rows' boxes with (N, 4); 0 where there is none."""
    left, top, right, bottom = np.asarray(boxes).T
    wide = np.minimum(rows.left + rows.width, right) - np.maximum(rows.left, left)
    high = np.minimum(rows.top + rows.height, bottom) - np.maximum(rows.top, top)
    both = np.clip(wide, 0, None) * np.clip(high, 0, None)
    union = rows.width * rows.height + (right - left) * (bottom - top) - both
    return np.asarray(np.nan_to_num(both / union), np.float64)


def _score_events(events: Sequence[Event], true_of: dict[int, int], truth: ObjectTruth) -> EventScore:
    """Each event of the script takes the nearest of its kind and object that is told."""
    left = [(event.time_s, true_of[event.object], event.kind) for event in events]
    differences = []
    for when, number, kind in truth.events:
        fitting = [one for one in left if one[1:] == (number, kind) and abs(one[0] - when) <= _PUNCTUAL_S]
        if fitting:
            difference, nearest = min((abs(one[0] - when), one) for one in fitting)
            left.remove(nearest)
            differences.append(difference)
    return EventScore(len(truth.events), len(differences), len(left), max(differences, default=0.0))


def _mean(values: Floats) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _median(values: Floats) -> float | None:
    return float(np.median(values)) if len(values) else None


def run_objects(
    chosen: dict[str, tuple[Path, Path]],
    factory: Callable[[int], samples.Runnable],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
) -> Report:
    """Run every clip ``runs`` times and report the means; parameters as of `samples.run_samples`."""
    tasks = [
        samples.ClipRun(name, clip, truth, factory, seed + run)
        for name, (clip, truth) in chosen.items()
        for run in range(runs)
    ]
    scores = in_processes(_run, tasks, jobs, quiet)
    objects, events = [], []
    for place, name in enumerate(chosen):
        own = scores[place * runs : (place + 1) * runs]
        events.append({"name": name, **_averaged([asdict(one.events) for one in own])})
        for number in own[0].objects:
            by_run = [asdict(one.objects[number]) for one in own]
            objects.append({"name": name, "object": number, **_averaged(by_run), "by_run": by_run})
    return {"runs": runs, "seed": seed, "objects": objects, "events": events}


def _run(task: samples.ClipRun) -> ObjectsScore:
    result = task.factory(task.seed).run(task.clip)
    return score(result, load_truth(task.truth, float(result.info.fps)))


def _averaged(rows: Sequence[dict[str, float | None]]) -> dict[str, float | None]:
    """Mean of each field over the rows that have it."""
    return {
        field: _mean(np.array([row[field] for row in rows if row[field] is not None])) for field in rows[0]
    }


def parser() -> argparse.ArgumentParser:
    """The options of ``objects``."""
    made = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark objects",
        description=_HELP,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("folder", metavar="DIR", type=Path, help="where the sample clips lie")
    add_config(made)
    add_runs(made)
    add_only(made)
    return made


def measure(options: argparse.Namespace) -> None:
    """Measure clips; prints a table of objects and one of events."""

    def scores() -> Report:
        chosen = samples.clips(options.folder, options.only)
        factory = samples.PipelineFactory(configuration(options.config))
        return run_objects(chosen, factory, options.runs, options.seed, options.jobs)

    tell("objects", options, scores, as_table)


def as_table(report: Report) -> str:
    """A line for each object, and one for each clip's events."""
    columns = {
        "clip": "name",
        "object": "object",
        "IoU": "iou",
        "seen %": "seen",
        "contact told %": "told",
        "error s": "error_s",
        "error %": "error_percent",
        "over limit": "over_limit",
        "away": "away",
    }
    objects = [[line[field] for field in columns.values()] for line in report["objects"]]
    mean = _mean(np.array([line["iou"] for line in report["objects"] if line["iou"] is not None]))
    happened = {"clip": "name", "events": "true", "found": "found", "extra": "extra", "late s": "late"}
    events = [[line[field] for field in happened.values()] for line in report["events"]]
    runs = "1 run" if report["runs"] == 1 else f"{report['runs']} runs"
    lines = [
        f"objects: {len(report['events'])} clips, {runs}",
        table.align(tuple(columns), objects) if objects else "no object",
        f"mean IoU: {mean:.2f}" if mean is not None else "",
        table.align(tuple(happened), events),
    ]
    return "\n\n".join(line for line in lines if line)
