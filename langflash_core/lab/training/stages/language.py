"""Language features, from phrases for the instances of single pictures."""

from dataclasses import replace

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.losses import language_loss
from langflash_core.lab.training.stages.pixels import balanced_pixels, nearest
from langflash_core.lab.training.stages.stage import Loss, Words, as_numbers, guided, tokens_of
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.model import LangFlashNet

PIXELS_PER_PICTURE = 512
"""Pixels that the language stage draws from one picture, balanced over its instances."""

TOKEN_DROPOUT = 0.15
"""Share of token channels that the language stage hides in a picture."""


def language_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """L(x) against the sampled phrase of each pixel's instance; pixels are drawn class-balanced.

    The last layer runs on the drawn pixels only: it is per pixel, so
    nothing changes. Channels of the tokens are dropped, so that the head names things by more
    than what gives away one piece of furniture.
    """
    head = guided(network).language_head
    tokens = thinned(tokens_of(network, batch), TOKEN_DROPOUT, words.generator)
    hidden = head.hidden(tokens)  # (B*V, F, h, w)
    scenes = [words.sampler.draw(labels, words.generator) for labels in batch.labels]
    bank = phrase_bank(torch.cat(scenes), words)
    features, rows, true = [], [], []
    for b, labels in enumerate(batch.labels):
        holds = words.sampler.true(labels)[:, bank]
        for v in range(batch.images.shape[1]):
            ids = nearest(batch.instances[b, v], (hidden.shape[-2], hidden.shape[-1]))
            chosen = balanced_pixels(ids, words.sampler.balance(labels), PIXELS_PER_PICTURE, words.generator)
            flat = hidden[b * batch.images.shape[1] + v].flatten(1).T
            features.append(flat[chosen])
            named = ids.flatten()[chosen].cpu()
            rows.append(scenes[b][named])
            true.append(holds[named])
    last = head.out
    vectors = F.linear(torch.cat(features), last.weight[:, :, 0, 0], last.bias)
    texts = words.sampler.table.embeddings.to(vectors.device)
    targets = texts[torch.cat(rows).to(vectors.device)]
    total = language_loss(
        vectors, targets, texts[bank.to(vectors.device)], true=torch.cat(true).to(vectors.device)
    )
    cosine = F.cosine_similarity(vectors.detach().float(), targets, dim=-1)
    return Loss(total, as_numbers(cosine=cosine.mean()))


def thinned(tokens: Tokens, share: float, generator: torch.Generator) -> Tokens:
    """Tokens with `share` of each view's channels set to 0 and the rest scaled up, hook by hook; without
    those of depth, which no name reads."""

    def thin(hook: Tensor) -> Tensor:
        kept = torch.rand(*hook.shape[:2], 1, hook.shape[-1], generator=generator) >= share
        return hook * (kept.to(hook) / (1 - share))

    return replace(tokens, deep=()).each(thin)


def phrase_bank(used: Tensor, words: Words, extra: int = 128) -> Tensor:
    """Rows (A,) of negatives: the batch's phrases, every class group and baseline, some random phrases."""
    table = words.sampler.table
    random = torch.randint(len(table.phrases), (extra,), generator=words.generator)
    return torch.cat((used.cpu(), table.standing_rows(), random)).unique()
