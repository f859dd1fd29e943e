"""Several methods on the same sequences, in the same run: the package's own first, then its peers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

from ifsvideo.benchmark import published
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.perturb import UNCHANGED, Perturbation
from ifsvideo.benchmark.runner import Report, run_points
from ifsvideo.types import Segmenter

NOISE_LEVELS = (0.01, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Standard deviations of the noise of the thesis's Fig. 4.2, pixels."""


@dataclass(frozen=True)
class Method:
    """A segmenter under test.

    Attributes
    ----------
    name : str
    factory : callable
        Makes a segmenter for a seed; it must be picklable.
    motions_known : bool
        Whether it is told the number of motions.
    """

    name: str
    factory: Callable[[int], Segmenter]
    motions_known: bool


@dataclass(frozen=True)
class Trial:
    """How every method is run: number of runs, first seed, processes, and what is done to the tracks."""

    runs: int = 1
    seed: int = 0
    jobs: int = 1
    perturbation: Perturbation = UNCHANGED
    quiet: bool = False

    def run(self, sequences: Sequence[LabelledSequence], method: Method) -> Report:
        """Scores of one method, as of `run_points`, with its name."""
        noise = f", noise {self.perturbation.noise:g} px" if self.perturbation.noise else ""
        scores = run_points(
            sequences,
            method.factory,
            self.runs,
            self.seed,
            self.jobs,
            method.motions_known,
            self.quiet,
            self.perturbation,
            title=method.name + noise,
        )
        return {"method": method.name, **scores}


def compare(
    dataset: str, sequences: Sequence[LabelledSequence], methods: Sequence[Method], trial: Trial
) -> Report:
    """Scores of the first method; those of the others are under "peers", others' figures under "published".

    Raises
    ------
    IfsVideoError
        If a process is killed from outside.
    """
    own, *peers = (trial.run(sequences, method) for method in methods)
    known = published.HOPKINS155 if dataset == "hopkins155" else ()
    return {**own, "peers": peers, "published": [asdict(one) for one in known]}


def add_number_known(
    report: Report, sequences: Sequence[LabelledSequence], method: Method, trial: Trial
) -> None:
    """Add the errors of a method that is told the number of motions to what it reached without.

    The same merges in the same order, cut at the true number: what is left to win by knowing when to stop.
    """
    told = trial.run(sequences, replace(method, motions_known=True))
    report["number_known"] = told["error"]["all"]
    for row, known in zip(report["sequences"], told["sequences"], strict=True):
        row["number_known"] = known["error"]


def noise_curve(
    sequences: Sequence[LabelledSequence], methods: Sequence[Method], trial: Trial, measured: Report
) -> list[Report]:
    """Error of every method without noise and at each of `NOISE_LEVELS`, on tracks spoilt alike.

    Parameters
    ----------
    measured : Report
        What `compare` reported of the same trial; it is not measured again.

    Returns
    -------
    list of {"method", "motions_known", "noise", "error", "std", "exact_count"}
        Ordered by method, then noise.
    """
    curve = []
    for method, at_hand in zip(methods, [measured, *measured["peers"]], strict=True):
        for noise in (0.0, *NOISE_LEVELS):
            spoilt = replace(trial, perturbation=replace(trial.perturbation, noise=noise))
            scores = at_hand if spoilt == trial else spoilt.run(sequences, method)
            kept = ("method", "motions_known", "noise", "error", "std", "exact_count")
            curve.append({key: scores[key] for key in kept})
    return curve
