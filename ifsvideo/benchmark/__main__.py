"""Measure the segmenter on data whose truth is known; a table to stdout, the same figures to a JSON file.

hopkins155  DIR holds NAME/NAME_truth.mat
kt3dmoseg   DIR holds NAME_Tracks.mat, and frames, where there are, under OriginalSequences/NAME/
tracks      DIR or its subfolders hold tracks of your own, NAME.npz: xy (F, P, 2) pixels, NaN where not seen,
            optional visible (F, P), labels (P,) integers: groups from 1, 0 not known; or .mat as above
samples     DIR holds NAME.mp4 and NAME_truth.npz (masks (F, H, W) uint8: 0 background, k object k)

and, with options of their own (throughput --help, objects --help, and so on),

throughput CLIP  how fast the whole program is beside decoding, tracking and encoding, and its memory
objects DIR      the sample clips: boxes, times to contact and events of the objects
cost CLIP        what the further outputs cost, beside the overlay alone
page             how large a page of many objects is, and how soon Chromium shows it
static CLIP ...  clips in which nothing moves: how much is called moving, or not decided
marked CLIP ...  real clips in which what moves was marked by hand: how much of it is found, and what besides

Scoring of hopkins155, kt3dmoseg and tracks. Error of one sequence, per cent: 100 x (1 - the greatest number
of points that a one-to-one matching of estimated to true labels gets right / labelled points), -1 counting
as wrong, true label 0 not counted; averaged over runs, then over sequences. Exact count: per cent of
(sequence, run) pairs with the right number of groups among the labelled points, background included.
Seconds: spent segmenting, on one thread, summed over the sequences, of one run. Std: of the mean error,
over runs. Moves: a point is truly moving if its group is not 1, called moving if its label is > 0;
precision and recall in per cent over the points of all sequences and runs together. All one motion: the
error of calling everything background. Beside hopkins155 stand the figures that were published for it, beside
kt3dmoseg the error with the number of motions told ("number known, same tree": the same merges, cut there).

Scoring of kt3dmoseg --video. The whole program runs on the frames. A labelled point, in each frame in which
it is seen, takes the label of the program's nearest point in that frame, if one is within 10 pixels, and is
then scored as above, -1 counting as wrong; error averaged over runs, then over sequences; precision, recall
and coverage over all points together. Coverage: per cent of the labelled points with such a neighbour.

Scoring of samples. The whole pipeline runs on each clip, and every row of the labels is compared with the
mask at its rounded position (all rows count, also those at a mask's border); a row truly moves if the mask
is > 0 there. Found: per cent of the moving rows with label > 0 (-1 is wrong). False and undecided: per cent
of the other rows with label > 0, and with -1. IDF1: 100 x 2 IDTP / (2 IDTP + IDFP + IDFN), moving rows as
truth, rows with label > 0 as predictions, IDTP the rows that the best one-to-one matching of object to mask
numbers over the whole clip gets right. Longest false: the longest life, in seconds, of an object of which
less than half the rows move. Mean over runs, then over clips.

--peers also runs RANSAC, SSC and RSIM, each told the number of motions; they decide on tracks without a gap
only. "Given" and "found" say so of every method.

Run r uses seed S + r, for the segmenter, for its peers, and for --noise and --drop.

learn --hopkins155 DIR --kt3dmoseg DIR --samples DIR --simulated N --write FILE, any of these data, learns the
weights by which segments are merged instead, and tells what they reach; see learn --help.
"""

from __future__ import annotations

import argparse
import shlex
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ifsvideo.benchmark import (
    comparison,
    cost,
    datasets,
    driving,
    learning,
    learning_data,
    marked,
    objects,
    page,
    samples,
    static,
    table,
    throughput,
)
from ifsvideo.benchmark.comparison import Method, Trial
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.learning_data import Example
from ifsvideo.benchmark.options import (
    STATUS,
    add_config,
    add_only,
    add_runs,
    configuration,
    made_folder,
    tell,
    whole,
    write_report,
    write_text,
)
from ifsvideo.benchmark.perturb import Perturbation
from ifsvideo.benchmark.runner import IFSFactory, Report
from ifsvideo.benchmark.side_by_side import draw_all
from ifsvideo.config import Config
from ifsvideo.errors import IfsVideoError, UsageError
from ifsvideo.output.atomic import check_writable
from ifsvideo.segmentation.similarity import Rules, learnt

_LEARN = """\
Learn the weights of stage 5 (its second pass), which merges segments by a logistic rule, and measure what
they reach.

Every sequence is taken to segments (stages 1 to 4). Segments of which at least 80 % of the labelled points
are of one motion are merged as an oracle would, and pairs of groups on the way are what is learnt from. Then
the whole of stage 5 runs on every sequence: with weights learnt from five other sixths of the data ("held
out"; sequences that show the same frames are in one sixth), and with those learnt from all ("in sample").
Error, exact count, precision and recall are counted as for the point data sets; no group of hopkins155 is
known to be the background, so that nobody can say there what moves. --ablate learns and judges once more
without each cue (ifsvideo/segmentation/cues.py), held out, and takes about three times as long.

--samples takes the windows of the clips, tracked by the package's own tracker; a track's motion is what the
masks show under most of its rows there. Simulated windows have the seeds S, S + 1, ...; --only does not
choose among them. Run r takes seed S + r to stages 1 to 4. At least one source is needed.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit status, as `ifsvideo` does."""
    line = list(sys.argv[1:] if arguments is None else arguments)
    if line[:1] == ["learn"]:
        run, options = _learn, _learning_parser().parse_args(line[1:])
    elif line[:1] == ["throughput"]:
        run, options = throughput.measure, throughput.parser().parse_args(line[1:])
    elif line[:1] == ["objects"]:
        run, options = objects.measure, objects.parser().parse_args(line[1:])
    elif line[:1] == ["cost"]:
        run, options = cost.measure, cost.parser().parse_args(line[1:])
    elif line[:1] == ["page"]:
        run, options = page.measure, page.parser().parse_args(line[1:])
    elif line[:1] == ["static"]:
        run, options = static.measure, static.parser().parse_args(line[1:])
    elif line[:1] == ["marked"]:
        run, options = marked.measure, marked.parser().parse_args(line[1:])
    else:
        run, options = _measure, _parser().parse_args(line)
    signal.signal(signal.SIGTERM, _terminate)
    try:
        run(options)
    except IfsVideoError as fault:
        print(f"error: {fault}", file=sys.stderr)
        return fault.exit_status
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark",
        description=__doc__,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("dataset", metavar="DATASET", choices=("hopkins155", "kt3dmoseg", "tracks", "samples"))
    add("folder", metavar="DIR", type=Path, help="where the data set lies")
    add_config(parser)
    add_runs(parser)
    add_only(parser)
    points = parser.add_argument_group("of hopkins155, kt3dmoseg and tracks only")
    add = points.add_argument
    add("--motions-known", action="store_true", help="tell the segmenter the number of motions")
    add("--peers", action="store_true", help="also run others' methods, each told the number of motions")
    add(
        "--noise",
        metavar="SIGMA",
        type=_sigma,
        default=0.0,
        help="Gaussian noise added to the tracks, pixels",
    )
    add(
        "--drop", metavar="SHARE", type=_share, default=0.0, help="share of the observations deleted, below 1"
    )
    add(
        "--plot",
        metavar="DIR",
        type=Path,
        help="draw errors, noise (six more measurements) and numbers of motions there (needs ifsvideo[plot])",
    )
    add("--show", metavar="NAME", help="with --plot: draw the stages of this sequence, too")
    add("--verbose", action="store_true", help="a line for each sequence of hopkins155, too")
    frames = parser.add_argument_group("of kt3dmoseg only")
    add = frames.add_argument
    add("--video", action="store_true", help="also run the whole program on the frames")
    add(
        "--overlay",
        metavar="DIR",
        type=Path,
        help="write each clip there, with the truth and what the first run found, of the tracks or, with "
        "--video, of the frames",
    )
    return parser


def _learning_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m ifsvideo.benchmark learn",
        description=_LEARN,
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    for source in ("hopkins155", "kt3dmoseg", "samples"):
        add(f"--{source}", metavar="DIR", type=Path, help="learn from it; where it lies")
    add("--simulated", metavar="N", type=whole(1), help="learn from so many simulated windows")
    add("--write", metavar="FILE", type=Path, help="write the weights there, as similarity.toml has them")
    add("--ablate", action="store_true", help="tell what is reached without each cue, too")
    add_runs(parser)
    add_only(parser)
    return parser


def _sigma(text: str) -> float:
    try:
        return Perturbation(noise=float(text)).noise
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of pixels, 0 or more") from None


def _share(text: str) -> float:
    try:
        return Perturbation(drop=float(text)).drop
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no share from 0 to below 1, such as 0.1") from None


def _terminate(*_: object) -> NoReturn:
    """Unwind on SIGTERM, so that no worker stays behind."""
    sys.exit(143)


def _check(options: argparse.Namespace) -> None:
    """Refuse what cannot end well before the work, not after it."""
    if options.dataset == "samples":
        given = {
            name
            for name in ("motions_known", "peers", "noise", "drop", "plot", "show")
            if vars(options)[name]
        }
        if given:
            name = min(given).replace("_", "-")
            raise UsageError(f"--{name}: is for tracks with a truth; leave the option out for samples")
    if options.dataset != "kt3dmoseg" and (options.video or options.overlay):
        name = "video" if options.video else "overlay"
        raise UsageError(
            f"--{name}: is for frames with labelled tracks; leave the option out, or measure kt3dmoseg"
        )
    if options.show is not None and not options.plot:
        raise UsageError("--show draws pictures; say where by --plot DIR")
    if options.json:
        check_writable(options.json)
    if options.plot:
        _need_matplotlib()
    for folder in (options.plot, options.overlay):
        if folder:
            check_writable(folder / "one.file" if folder.is_dir() else folder)


def _need_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError:
        raise UsageError("--plot needs matplotlib; install it by: pip install 'ifsvideo[plot]'") from None


def _measure(options: argparse.Namespace) -> None:
    """Measure the segmenter, or the pipeline, on one data set."""
    _check(options)
    if options.dataset == "samples":
        _measure_samples(options)
    else:
        _measure_points(options)


def _measure_samples(options: argparse.Namespace) -> None:
    def scores() -> Report:
        chosen = samples.clips(options.folder, options.only)
        factory = samples.PipelineFactory(configuration(options.config))
        return samples.run_samples(chosen, factory, options.runs, options.seed, options.jobs)

    tell("samples", options, scores, table.samples)


def _measure_points(options: argparse.Namespace) -> None:
    sequences = datasets.load(options.dataset, options.folder, options.only)
    shown = next((sequence for sequence in sequences if sequence.name == options.show), None)
    if options.show is not None and shown is None:
        raise UsageError(
            f"--show: no sequence is called {options.show}; --verbose without --show lists their names"
        )
    if options.video or options.overlay:
        driving.check_frames(sequences, options.folder)
    own = Method("ifsvideo", IFSFactory(configuration(options.config).segmentation), options.motions_known)
    methods = [own, *(_peers() if options.peers else ())]
    trial = Trial(options.runs, options.seed, options.jobs, Perturbation(options.noise, options.drop))
    scores = comparison.compare(options.dataset, sequences, methods, trial)
    report = {"dataset": options.dataset, "configuration": options.config, **scores}
    if options.dataset == "kt3dmoseg":
        _add_driving(report, sequences, own, trial, options)
    if options.plot:
        report["noise_curve"] = comparison.noise_curve(sequences, methods, trial, report)
    print(table.points(report, by_sequence=options.verbose or options.dataset != "hopkins155"))
    if options.json:
        write_report(options.json, report)
    if options.plot:
        _draw(options.plot, report, shown, own, trial)


def _add_driving(
    report: Report,
    sequences: Sequence[LabelledSequence],
    own: Method,
    trial: Trial,
    options: argparse.Namespace,
) -> None:
    """What only kt3dmoseg is asked: the floor of a known number, the frames, clips to look at."""
    if not own.motions_known:
        comparison.add_number_known(report, sequences, own, trial)
    overlay = made_folder(options.overlay) if options.overlay else None
    if options.video:
        factory = samples.PipelineFactory(configuration(options.config))
        report["video"] = driving.run_frames(
            sequences, options.folder, factory, trial.runs, trial.seed, trial.jobs, overlay=overlay
        )
    elif overlay:
        draw_all(sequences, options.folder, own, trial, overlay)


def _learn(options: argparse.Namespace) -> None:
    """Learn the weights of stage 5; they are written only once everything is done."""
    for target in (options.write, options.json):
        if target:
            check_writable(target)
    examples = _examples(options)
    rule, scores = learning.learn(examples, options.runs, options.seed, options.jobs, ablate=options.ablate)
    command = _command_of(options)
    print(learning.table(scores))
    if options.ablate:
        print(f"\n{learning.ablation_table(scores)}")
    if options.write:
        write_text(options.write, learning.as_toml(Rules(learnt().core, rule), command))
        print(f"wrote {options.write}")
    if options.json:
        write_report(options.json, {"command": command, **scores})


def _examples(options: argparse.Namespace) -> list[Example]:
    """The sequences of every source that was named."""
    found: list[Example] = []
    for dataset in ("hopkins155", "kt3dmoseg"):
        if folder := vars(options)[dataset]:
            found += learning_data.of_points(dataset, folder, options.only)
    if options.samples:
        found += learning_data.of_samples(options.samples, Config(), options.only, options.jobs)
    if options.simulated:
        # Imported here because no other command needs it.
        from ifsvideo.benchmark.simulation import simulate

        found += learning_data.of_simulation(simulate, options.simulated, options.seed, options.jobs)
    if not found:
        raise UsageError("nothing to learn from; name --hopkins155, --kt3dmoseg, --samples or --simulated")
    return found


def _command_of(options: argparse.Namespace) -> str:
    """The command that learns the same, with DIR for the places of one machine."""
    words = ["python -m ifsvideo.benchmark learn"]
    words += [f"--{name} DIR" for name in ("hopkins155", "kt3dmoseg", "samples") if vars(options)[name]]
    if options.simulated:
        words.append(f"--simulated {options.simulated}")
    if options.only != "*":
        words.append(f"--only {shlex.quote(options.only)}")
    return " ".join([*words, f"--runs {options.runs} --seed {options.seed}"])


def _draw(folder: Path, report: Report, shown: LabelledSequence | None, method: Method, trial: Trial) -> None:
    # Imported here because matplotlib is an extra.
    from ifsvideo.benchmark import plots, plots_sequence

    figures = plots.of_report(report)
    if shown:
        figures |= plots_sequence.of_sequence(shown, method, trial)
    for file in plots.write(figures, folder):
        print(f"wrote {file}")


def _peers() -> list[Method]:
    # Imported here because only --peers needs them.
    from ifsvideo.benchmark.peers import PEERS, PeerFactory

    return [Method(name, PeerFactory(name), motions_known=True) for name in PEERS]


if __name__ == "__main__":
    sys.exit(main())
