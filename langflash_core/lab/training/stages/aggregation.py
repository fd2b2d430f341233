"""Atoms of the parts that the frozen grouping finds.

Sizes: V views, h w of features, K parts, M of them named, G groups, N instances, C channels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.grouping import AggregationWeights, GroupTexts, aggregation_loss
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.stages.grouping import group_masks
from langflash_core.lab.training.stages.language import phrase_bank
from langflash_core.lab.training.stages.pixels import nearest
from langflash_core.lab.training.stages.stage import Loss, Words, one_scene, tokens_of
from langflash_core.network.model import LangFlashNet
from langflash_core.network.semantics.aggregation import average_atoms


def aggregation_stage(
    network: LangFlashNet, batch: SceneBatch, words: Words, weights: AggregationWeights | None = None
) -> Loss:
    """L_LFA over the parts that the frozen grouping finds; a part is called what most of it shows."""
    losses, cosines = [], []
    for i in range(batch.images.shape[0]):
        found = named_parts(network, one_scene(batch, i))
        if found is None:
            continue
        collected = batch.vectors[i] if batch.vectors else None
        if collected is None:
            texts = _named_texts(found, batch.labels[i], words)
        else:  # of things without a name: all others of the scene are what they are not
            texts = collected_texts(collected.to(found.atoms), found, network.preset.space)
        chosen = weights or AggregationWeights()
        losses.append(aggregation_loss(found.atoms, found.pooled, found.quality, texts, chosen))
        cosines.append(float(F.cosine_similarity(found.atoms.detach(), texts.truth, dim=-1).mean()))
    if not losses:
        return Loss(sum(p.sum() for p in network.aggregation.parameters()) * torch.zeros(()), {"cosine": 0.0})
    return Loss(torch.stack(losses).mean(), {"cosine": sum(cosines) / len(cosines)})


def collected_texts(vectors: Tensor, found: "NamedParts", space: str) -> GroupTexts:
    """The vectors (N, C) of the instances that parts are, and all of the scene for a bank.

    Raises:
        InputError: they are not of the network's space.
    """
    channels = found.atoms.shape[1]
    if vectors.shape[1] != channels:
        raise InputError(
            f"collected vectors have {vectors.shape[1]} numbers, those of the network {channels}; collect "
            f"them again, with langflash lab labels --vectors {space}"
        )
    return GroupTexts(vectors[found.instances], vectors)


def _named_texts(found: "NamedParts", labels: Sequence[Label], words: Words) -> GroupTexts:
    """A phrase of each part's label, and a bank of which some are true of it, too."""
    instances = found.instances.cpu()
    phrases = words.sampler.draw(labels, words.generator)[instances]
    bank, embeddings = phrase_bank(phrases, words), words.sampler.table.embeddings
    return GroupTexts(
        embeddings[phrases].to(found.atoms),
        embeddings[bank].to(found.atoms),
        words.sampler.true(labels)[instances][:, bank].to(found.atoms.device),
    )


@dataclass(frozen=True)
class NamedParts:
    """M parts of a scene that show something labelled: atoms and pooled (M, C), instances (M,), and
    quality (M,), the share of a part that is its instance."""

    atoms: Tensor
    pooled: Tensor
    quality: Tensor
    instances: Tensor


def named_parts(network: LangFlashNet, batch: SceneBatch) -> NamedParts | None:
    """The atoms of one scene (B = 1) made as at run time, and the instance each mostly covers."""
    with torch.no_grad():
        tokens = tokens_of(network, batch)
        features = None if batch.frozen is None else batch.frozen.features
        if features is None:
            features = network.language(tokens, batch.images).float()
        size = (features.shape[-2], features.shape[-1])
        weights = network.parts(tokens, batch.images, size, features)[None]
        masks, instances = group_masks(nearest(batch.instances[0], size))  # (G, V*h*w), (G,)
        if weights.shape[2] == 0 or len(instances) == 0:
            return None
        quality, majority = mostly(weights[0], masks, network.preset.eps)
        named = quality > 0
        pooled = average_atoms(weights, features, network.preset.eps)[0]
    atoms = network.aggregation(weights, features)[0]
    return NamedParts(
        atoms[named], F.normalize(pooled[named], dim=-1), quality[named], instances[majority[named]]
    )


def mostly(weights: Tensor, masks: Tensor, eps: float) -> tuple[Tensor, Tensor]:
    """Of each part, (K,), the share that lies on the group it covers most, and that group's row.

    Args:
        weights: w_k(x), (V, K, h, w). masks: (G, V*h*w) of 0 and 1, G >= 1.
    """
    overlap, majority = (weights.transpose(0, 1).flatten(1).float() @ masks.T).max(1)
    return overlap / (weights.sum((0, 2, 3)) + eps), majority
