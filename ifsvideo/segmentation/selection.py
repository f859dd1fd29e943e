"""Between stages 3 and 4: which of the sampled models are needed at all.

A hundred disks sample every surface several times, and a field that may choose among all these cuts one
surface into a dozen segments. A model is kept if it saves more residual than it costs: the label costs of
Delong, Osokin, Isack and Boykov (Fast Approximate Energy Minimization with Label Costs, IJCV 2012), whose
greedy start for an energy without smoothness this is (uncapacitated facility location).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def needed_models(cost: NDArray[np.float64], label_cost: float) -> NDArray[np.int64]:
    """Models to keep, each the one that then lowers what points pay most, while it does by ``label_cost``.

    Parameters
    ----------
    cost : (P, M) float
        What point p pays if model m explains it, pixels.
    label_cost : float
        What a model costs, in the same unit; 0 keeps every model that explains some point best.

    Returns
    -------
    (K,) int
        Indices, rising; at least one where there is any model.
    """
    kept: list[int] = []
    paid = np.full(len(cost), np.inf)
    while len(kept) < cost.shape[1]:
        if kept:
            saved = np.maximum(paid[:, None] - cost, 0.0).sum(axis=0)
            best = int(saved.argmax())
            if saved[best] <= label_cost:
                break
        else:
            best = int(cost.sum(axis=0).argmin())
        kept.append(best)
        paid = np.minimum(paid, cost[:, best])
    return np.array(sorted(kept), dtype=np.int64)
