"""Between two passes of stage 5: the world as those points see it that are surely static.

Stage 1 fits one world to everything that a window shows, and so to parts of what moves: with a few movers at
depths of its own choice a camera path is found on which halves of two of them stand still. So segments merge
cautiously at first. The widest group is then one motion, the static world's; a world that is fitted to it
alone tells truly how all others move.
"""

from __future__ import annotations

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.background import static_group
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues
from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.similarity import Similarity
from ifsvideo.segmentation.world import World


def in_static_core(
    cues: Cues, window: Window, world: World | None, rule: Similarity, config: SegmenterConfig
) -> Cues:
    """What is measured in the world of what is surely static.

    Parameters
    ----------
    cues : Cues
        What is measured in the world of stage 1.
    window : Window
    world : World or None
        That of stage 1; where there is none, nothing changes.
    rule : Similarity
        Which segments are one motion, in a world that may be wrong.
    config : SegmenterConfig
        ``core_doubt`` 0 leaves out this pass.
    """
    if world is None or config.core_doubt == 0:
        return cues
    groups = Agglomeration(cues, rule).run(window, stop=config.core_doubt)
    core = groups[static_group(groups, cues.anchor, window.size)].reliable
    own = world.fitted_to(core)
    leeway = Leeway(own, core, config.evidence_threshold) if own is not world else None
    return cues.in_world(own.evidence(config.evidence_threshold), own.nearness, leeway)
