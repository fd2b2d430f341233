"""What each of several processes runs for `test_ranks`: stages on the toy rooms, a few steps each.

python -m torch.distributed.run ... tests/lab/training/shared_steps.py ROOMS RUN BATCHES STEPS STAGE...

A stage with a mark, as in "refine!", has no finite loss in the second batch of the first step.
"""

import sys
from dataclasses import replace
from pathlib import Path

import torch

from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.ranks import joined
from langflash_core.lab.training.stages.stage import Loss, Stage, Words
from langflash_core.lab.training.stages.table import STAGES
from langflash_core.lab.training.words import PhraseSampler, build_table
from langflash_core.network import MINI, GuidedDepthNet
from tests.lab.training.conftest import encode


def spoiled(stage: Stage) -> Stage:
    """Which batch of a step it is shows in its generator's seed."""
    calls: dict[int, int] = {}

    def loss(network, batch, words: Words) -> Loss:
        seed = words.generator.initial_seed()
        calls[seed] = calls.get(seed, 0) + 1
        found = stage.loss(network, batch, words)
        return Loss(found.total * torch.nan, found.parts) if seed != 5 and calls[seed] == 1 else found

    return replace(stage, name=f"{stage.name}!", loss=loss)


def train(rooms: Path, run: Path, batches: int | None, steps: int, stages: list[str]) -> None:
    """The stages one after the other, each on a freshly drawn network; a row of the log every step."""
    read = RoomSet(rooms)
    table = build_table(read.labels(), encode)
    with joined("cpu") as device:
        for name in stages:
            torch.manual_seed(0)
            words = Words(PhraseSampler(table), torch.Generator().manual_seed(5))
            options = LoopOptions(
                minutes=1e6, device=device, seed=3, max_steps=steps, report_s=0.0, save_s=0.0, pictures=2,
                batches=batches, precision="float32",
            )  # fmt: skip
            stage = STAGES[name] if name in STAGES else spoiled(STAGES[name.rstrip("!")])
            train_stage(GuidedDepthNet(MINI), stage, read, words, run, options)


if __name__ == "__main__":
    torch.set_num_threads(1)
    rooms, run, batches, steps, *stages = sys.argv[1:]
    train(Path(rooms), Path(run), int(batches), int(steps), stages)
