"""The stages by name, with every number of theirs."""

from dataclasses import replace

from langflash_core.lab.training.stages.aggregation import aggregation_stage
from langflash_core.lab.training.stages.depth import depth_stage, points_stage, refine_stage
from langflash_core.lab.training.stages.gaussians import gaussians_stage
from langflash_core.lab.training.stages.grouping import grouping_stage
from langflash_core.lab.training.stages.language import language_stage
from langflash_core.lab.training.stages.stage import Stage

_DEPTH = ("decoder", "depth_head")
_GROUPING = ("siamese", "scratch", "grouping")
_LAST = ("aggregation",)
_PAIRS = {2: 0.8, 3: 0.2}
STAGES = {
    stage.name: stage
    for stage in (
        Stage("depth", _DEPTH, (), {1: 0.2, 2: 0.65, 3: 0.15}, 8, 5e-4, depth_stage, photos=0.6),
        Stage("refine", ("refiner",), ("depth",), _PAIRS, 8, 1e-3, refine_stage),
        Stage("gaussians", ("gaussian_head",), ("depth", "refine"), {3: 1.0}, 6, 5e-4, gaussians_stage),
        Stage("language", ("language_head",), (), {1: 1.0}, 12, 1e-3, language_stage),
        Stage("grouping", _GROUPING, (), _PAIRS, 8, 5e-4, grouping_stage, photos=0.5),
        Stage("aggregation", _LAST, ("language", "grouping"), _PAIRS, 8, 3e-4, aggregation_stage, photos=0.5),
    )
}
"""What `mini` trains; `full` trains `POINT_STAGES`, of which grouping and aggregation are the same."""

POINT_STAGES = {
    "points": Stage("points", ("decoder", "point_heads"), (), _PAIRS, 8, 2e-4, points_stage),
    "grouping": replace(STAGES["grouping"], needs=("points",), learning_rate=2e-4),
    "aggregation": replace(STAGES["aggregation"], needs=("grouping",), learning_rate=2e-4),
}
