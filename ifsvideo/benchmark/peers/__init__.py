"""Published segmenters to compare with: plain implementations that are given the number of motions."""

from __future__ import annotations

from dataclasses import dataclass

from ifsvideo.benchmark.peers.base import Peer
from ifsvideo.benchmark.peers.ransac import RansacSubspaces
from ifsvideo.benchmark.peers.rsim import RobustShapeInteraction
from ifsvideo.benchmark.peers.ssc import SparseSubspaceClustering

__all__ = [
    "PEERS",
    "Peer",
    "PeerFactory",
    "RansacSubspaces",
    "RobustShapeInteraction",
    "SparseSubspaceClustering",
]

PEERS: dict[str, type[Peer]] = {
    "ransac": RansacSubspaces,
    "ssc": SparseSubspaceClustering,
    "rsim": RobustShapeInteraction,
}
"""Class of each peer, by the name that a command takes."""


@dataclass(frozen=True)
class PeerFactory:
    """Makes the peer of a name (a key of `PEERS`) for a seed; can be sent to another process."""

    name: str

    def __call__(self, seed: int) -> Peer:
        return PEERS[self.name](seed)
