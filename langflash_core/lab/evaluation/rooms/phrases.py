"""Phrases asked of a room: things that are there, things that are not, and other words for them."""

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.evaluation.metrics import mask_iou
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE, Setting, Tally
from langflash_core.lab.evaluation.rooms.truth import group_mask, visible_groups
from langflash_core.lab.evaluation.tables import rounded
from langflash_core.lab.evaluation.words import PARAPHRASES, absent_phrases
from langflash_core.lab.training.measures import nan_mean
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.language.answers import presence_scores
from langflash_core.language.relevance import relevancy, rival_terms
from langflash_core.language.settings import RELEVANCE
from langflash_core.language.spaces import encode_cached
from langflash_core.language.vocabulary import OWN
from langflash_core.types import Prediction

PHRASES = 20
"""Asked per scene: half of them things that are there, half things that are not."""
MASK_THRESHOLDS = tuple(round(0.3 + 0.01 * step, 2) for step in range(70))


def ask_phrases(
    setting: Setting, record: RoomRecord, prediction: Prediction, tally: Tally, *, varied: bool = False
) -> None:
    """Scores of things that are in photo 0 and of things that are not, with the truth of each.

    varied: every second thing is called by another word of the training vocabulary.
    """
    generator = torch.Generator().manual_seed(record.seed)
    there = visible_groups(record, view=0)
    anywhere = sorted({label.group for label in record.labels})
    order = torch.randperm(len(there), generator=generator).tolist()
    present = [there[i] for i in order[: PHRASES // 2]]
    absent = absent_phrases(anywhere, setting.groups, setting.texts, PHRASES - len(present), generator)
    if not present:
        return
    asked = [p for p in (*present, *absent) if p in setting.groups]
    words = [_other_word(p, i) if varied and i % 2 else p for i, p in enumerate(asked)]
    vectors = setting.space.encode(words)
    mixed = torch.einsum("khw,kc->hwc", prediction.weights[0], prediction.dictionary)
    features, norms = F.normalize(mixed, dim=-1), mixed.norm(dim=-1).clamp_min(RELEVANCE.empty_norm)
    beaten = rival_terms(prediction.dictionary, setting.space, words, vectors)
    added = torch.einsum("khw,kp->phw", prediction.weights[0], beaten) / norms
    positives = (torch.einsum("hwc,pc->phw", features, vectors) + added).clamp(-1, 1)
    negatives = torch.einsum("hwc,mc->mhw", features, setting.negatives)
    maps = relevancy(positives, negatives, setting.temperature)
    covered = torch.ones(maps.shape[-2:], dtype=torch.bool)
    tally.scores.append(presence_scores(maps, covered))
    known = [p for p in present if p in setting.groups]
    tally.truths.append(torch.arange(len(vectors)) < len(known))
    for phrase, values in zip(known, maps, strict=False):
        truth = group_mask(record, phrase, view=0)
        tally.mask_ious.append(torch.tensor([mask_iou(values >= limit, truth) for limit in MASK_THRESHOLDS]))


def _other_word(group: str, turn: int) -> str:
    """One of the words that mean this group alone; its name where there is none."""
    words = OWN.get(group) or (group,)
    return words[turn % len(words)]


def note_paraphrases(setting: Setting, maps: Tensor, truth: Tensor, tally: Tally) -> None:
    """IoU of other words with all they are true of, and of the plain names of the same things.

    The names' mask is the union of the masks of all those names that are well in sight: what
    somebody would get who typed them one by one. Same pixels, same threshold, no rivals.

    Args:
        maps: (H, W, C). truth: (H*W,) row of each pixel's class group, -1 for none.
    """
    units = F.normalize(maps, dim=-1).flatten(0, 1)
    negatives = (units @ setting.negatives.T).T
    there = torch.bincount(truth[truth >= 0], minlength=len(setting.groups)) / truth.numel()
    others = encode_cached(setting.space, tuple(PARAPHRASES))

    def mask(vectors: Tensor) -> Tensor:
        found = relevancy((units @ vectors.T).T, negatives, setting.temperature)
        return (found >= setting.threshold).any(0)

    for vector, (phrase, covered) in zip(others, PARAPHRASES.items(), strict=True):
        own = [row for row, group in enumerate(setting.groups) if group in covered and there[row] > 0]
        if float(there[own].sum()) < MIN_SHARE:
            continue
        pixels = torch.isin(truth, torch.tensor(own))
        asked = mask_iou(mask(vector[None]), pixels)
        names = [row for row in own if there[row] >= MIN_SHARE] or [max(own, key=lambda row: there[row])]
        named = mask_iou(mask(setting.texts[names]), pixels)
        tally.note(paraphrase_iou=asked, name_iou=named)
        tally.paraphrases.setdefault(phrase, []).append((asked, named))


def paraphrase_report(tally: Tally) -> dict[str, dict[str, float | None]]:
    """Per phrase: how often it was asked, its mean IoU, and that of the plain names."""
    return {
        phrase: {
            "asked": len(ious),
            **rounded({"iou": nan_mean(i[0] for i in ious), "name_iou": nan_mean(i[1] for i in ious)}),
        }
        for phrase, ious in sorted(tally.paraphrases.items())
    }
