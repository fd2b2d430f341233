"""The stage that teaches the namer: corrected atoms against what parts are called."""

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.losses import language_loss
from langflash_core.lab.training.measures import confusion
from langflash_core.lab.training.parts import PartBatch, joined
from langflash_core.lab.training.stages.language import phrase_bank
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, guided
from langflash_core.network.model import LangFlashNet
from langflash_core.network.semantics.settings import PART_NAMING

NOISE = 0.15
"""Of standardised inputs; stands for makes of furniture that are not there to learn from."""
HIDDEN = 0.1
"""Share of a room's token channels that are hidden from the namer."""
BLIND = 0.25
"""How often a part's place, and how often its atom, are hidden altogether: lengths may be wrong, and
on furniture that the language head learned from its atoms are better than on any other."""
DROPPED = 0.3
"""Share of the namer's own channels that are left out at a time."""
DRAWN = 256
"""Parts of a batch that the loss is taken over, by quality and by rarity."""
ABSENT = 0.3
"""Share of a room's parts that are left out at a time, so that no room is learned by heart."""
RARITY = 0.5
"""0: as classes come; 1: every class of a batch as often as any other."""


def naming_stage(network: LangFlashNet, batch: PartBatch, words: Words) -> Loss:
    """Contrast of corrected atoms against phrases that are true and false of the parts."""
    rooms = [_thinned(room, words.generator) for room in batch.rooms()]
    vectors = torch.cat([_renamed(network, room, words.generator) for room in rooms])
    batch = joined(rooms)
    counts = words.sampler.groups(batch.labels)
    rare = torch.bincount(counts.clamp_min(0)).float()[counts.clamp_min(0)] ** -RARITY
    drawn = torch.multinomial(batch.quality.cpu() * rare, DRAWN, replacement=True, generator=words.generator)
    labels = tuple(batch.labels[i] for i in drawn.tolist())
    phrases = words.sampler.draw(labels, words.generator)
    bank = phrase_bank(phrases, words)
    texts = words.sampler.table.embeddings.to(vectors.device)
    true = words.sampler.true(labels)[:, bank].to(vectors.device)
    targets = texts[phrases.to(vectors.device)]
    chosen = vectors[drawn.to(vectors.device)]
    total = language_loss(chosen, targets, texts[bank.to(vectors.device)], true=true)
    return Loss(total, {"cosine": float(F.cosine_similarity(chosen.detach(), targets, dim=-1).mean())})


def _thinned(room: PartBatch, generator: torch.Generator) -> PartBatch:
    """Some parts of one room; at least one."""
    chances = torch.rand(len(room.labels), generator=generator)
    return room.subset((chances >= min(ABSENT, float(chances.max()))).nonzero()[:, 0])


def _renamed(network: LangFlashNet, room: PartBatch, generator: torch.Generator) -> Tensor:
    """Corrected atoms of one room, from inputs with noise and gaps."""
    namer = guided(network).namer
    inputs = namer.standardise(room.atoms, room.looks, room.places)
    inputs = inputs + NOISE * torch.randn(inputs.shape, generator=generator).to(inputs)
    count, looks = len(inputs), room.looks.shape[1]
    kept = torch.ones_like(inputs)
    kept[:, :looks] = _kept((1, looks), HIDDEN, generator).to(kept)
    kept[:, looks : looks + PART_NAMING.place] = (torch.rand(count, 1, generator=generator) >= BLIND).to(kept)
    known = (torch.rand(count, 1, generator=generator) >= BLIND).to(kept)
    kept[:, looks + PART_NAMING.place :] = known
    context = namer.context(inputs * kept)
    context = context * _kept(tuple(context.shape), DROPPED, generator).to(context)
    typical = namer.mean[looks + PART_NAMING.place :]  # stands for an atom that is hidden
    return F.normalize(torch.where(known > 0, room.atoms, typical) + namer.out(context).float(), dim=-1)


def _kept(shape: tuple[int, ...], share: float, generator: torch.Generator) -> Tensor:
    """Dropout's mask: 0 for `share` of the entries, the rest scaled up."""
    return (torch.rand(shape, generator=generator) >= share).float() / (1 - share)


def measure_naming(network: LangFlashNet, batch: PartBatch, words: Words) -> dict[str, float | Tensor]:
    """Class group of each part, as its corrected atom says and as the atom before said."""
    table = words.sampler.table
    texts = table.embeddings[table.group_rows()]
    truth = words.sampler.groups(batch.labels)
    namer = guided(network).namer
    named = torch.cat([namer(room.atoms, room.looks, room.places) for room in batch.rooms()])
    return {
        key: confusion((vectors.float().cpu() @ texts.T).argmax(1), truth, len(table.groups))
        for key, vectors in (("named", named), ("before", batch.atoms))
    }


NAMING = Stage(
    "naming", ("namer",), ("language", "grouping", "aggregation"), {1: 1.0}, 12, 1.2e-3, naming_stage
)
