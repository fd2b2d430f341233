"""Groups, from the masks of instances over all views, and SAM's embedding where it teaches.

Sizes: B scenes, V views, h w the mask map's size, N queries, G groups, f channels.
"""

from dataclasses import replace

import torch
from torch import Tensor

from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.grouping import GroupingWeights, grouping_loss, mask_quality
from langflash_core.lab.training.losses import instance_contrast
from langflash_core.lab.training.shards import NOTHING
from langflash_core.lab.training.stages.pixels import balanced_pixels, nearest
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, as_numbers, frozen_tokens
from langflash_core.lab.training.student import Student
from langflash_core.network.model import LangFlashNet

CONTRAST_PIXELS = 768
"""Pixels per scene that the grouping stage compares with each other."""

MIN_GROUP_PIXELS = 12
"""Instances with fewer pixels over all views (at the mask map's sampled size) are not groups."""

STUDENT = "student"
"""What the network calls the module that regresses SAM's embedding, while there is one."""


def grouping_stage(
    network: LangFlashNet, batch: SceneBatch, words: Words, weights: GroupingWeights | None = None
) -> Loss:
    """L_SG after every scale of the decoder, on every second pixel of the mask map; of photos that are
    labelled in part, on the pixels that are.

    On the map that masks are read from come `instance_contrast` and, where the weights ask for it and the
    batch holds it, the regression of SAM's embedding.
    """
    weights = weights or GroupingWeights()
    memories, finest = network.semantic_maps(frozen_tokens(network, batch), batch.images)
    offset_y, offset_x = torch.randint(2, (2,), generator=words.generator).tolist()
    size = (finest.shape[-2], finest.shape[-1])
    sampled = finest[..., offset_y::2, offset_x::2]
    answers = network.grouping(memories, sampled, batch.images.shape[1])
    ids = nearest(batch.instances, size)[..., offset_y::2, offset_x::2]
    masks = [group_masks(i)[0] for i in ids]
    maps = sampled.unflatten(0, batch.images.shape[:2])  # (B, V, f, h, w)
    contrast = torch.stack([_contrast(m, i, words) for m, i in zip(maps, ids, strict=True)]).mean()
    losses, quality = [], []
    for answer in answers:
        flat = answer.mask_logits.transpose(1, 2).flatten(2)  # (B, N, V*h*w)
        for logits, existence, truth, own in zip(flat, answer.existence_logits, masks, ids, strict=True):
            if batch.partly:
                seen = (own != NOTHING).flatten()
                logits, truth = logits[:, seen], truth[:, seen]
            loss, chosen = grouping_loss(logits, existence, truth, weights)
            losses.append(loss)
            if answer is answers[-1] and len(chosen.queries):
                quality.append(float(mask_quality(logits[chosen.queries], truth[chosen.groups]).mean()))
    total = torch.stack(losses).mean() + weights.mse * contrast
    told = {"soft_iou": sum(quality) / max(len(quality), 1), **as_numbers(contrast=contrast)}
    if weights.teacher and batch.dense is not None:
        regressed = student_of(network).loss(finest, batch.dense)
        total, told = total + weights.teacher * regressed, told | as_numbers(teacher=regressed)
    return Loss(total, told)


def student_of(network: LangFlashNet) -> Student:
    """What turns the network's finest map into SAM's embedding while it trains."""
    student = getattr(network, STUDENT, None)
    assert isinstance(student, Student), "training attaches it where a stage wants it"
    return student


def taught(stage: Stage, network: LangFlashNet) -> Stage:
    """The stage with a student of SAM's embedding, which the network has from here on, where it wants one."""
    if not stage.dense:
        return stage
    if not hasattr(network, STUDENT):
        setattr(network, STUDENT, Student(network.preset.dpt_feature))
    return replace(stage, modules=(*stage.modules, STUDENT))


def untaught(network: LangFlashNet) -> None:
    """Take the student away: nobody reads it after training."""
    if hasattr(network, STUDENT):
        delattr(network, STUDENT)


def _contrast(maps: Tensor, ids: Tensor, words: Words) -> Tensor:
    """`instance_contrast` on pixels of one scene's maps (V, f, h, w), balanced over instances (V, h, w)."""
    weights = torch.ones(NOTHING, device="cpu")
    chosen = balanced_pixels(ids, weights, CONTRAST_PIXELS, words.generator)
    flat = maps.permute(0, 2, 3, 1).flatten(0, 2)
    return instance_contrast(flat[chosen], ids.flatten()[chosen])


def group_masks(ids: Tensor) -> tuple[Tensor, Tensor]:
    """Masks (G, V*h*w) of 0 and 1 and instance ids (G,) of one scene's instance maps (V, h, w).

    An instance is one group over all views; those under `MIN_GROUP_PIXELS` are left to nobody.
    """
    flat = ids.flatten()
    counts = torch.bincount(flat, minlength=NOTHING + 1)[:NOTHING]
    kept = (counts >= MIN_GROUP_PIXELS).nonzero().squeeze(-1)
    return (flat[None] == kept[:, None]).float(), kept
