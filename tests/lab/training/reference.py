"""Slow twins of the losses: float64, loops, one number at a time. And one of the training loop."""

import math

import numpy as np
import torch

from langflash_core.network.precision import mixed_precision


def depth_loss_twin(logs, targets, absolute):
    """`losses.depth_loss` by loops over pictures and pixels."""
    shapes, count, offsets = 0.0, 0, []
    for picture, truth in zip(logs, targets, strict=True):
        valid = np.isfinite(truth) & (truth > 0)
        residuals = picture[valid] - np.log(truth[valid])
        if not len(residuals):
            continue
        offsets.append(residuals.mean())
        shapes += np.abs(residuals - residuals.mean()).sum()
        count += len(residuals)
    return shapes / max(count, 1) + absolute * (np.abs(offsets).mean() if offsets else 0.0)


def gradient_loss_twin(logs, targets, scales):
    """`losses.gradient_loss` by loops over scales, pictures and neighbours."""
    total = 0.0
    for level in range(scales):
        step = 2**level
        sums, counts = [0.0, 0.0], [0, 0]
        for picture, truth in zip(logs[:, ::step, ::step], targets[:, ::step, ::step], strict=True):
            rows, columns = picture.shape
            for y in range(rows):
                for x in range(columns):
                    for axis, (dy, dx) in enumerate(((0, 1), (1, 0))):
                        if y + dy >= rows or x + dx >= columns:
                            continue
                        here, there = truth[y, x], truth[y + dy, x + dx]
                        if not (here > 0 and there > 0):
                            continue
                        slope = picture[y + dy, x + dx] - picture[y, x]
                        sums[axis] += abs(slope - math.log(there / here))
                        counts[axis] += 1
        total += sum(s / max(c, 1) for s, c in zip(sums, counts, strict=True))
    return total / scales


def language_loss_twin(features, targets, bank, temperature, synonym, attract):
    """`losses.language_loss`, pixel by pixel."""
    total = 0.0
    for feature, target in zip(features, targets, strict=True):
        unit = feature / np.linalg.norm(feature)
        positive = temperature * unit @ target
        rivals = [temperature * unit @ phrase for phrase in bank if target @ phrase <= synonym]
        total += math.log(sum(math.exp(r) for r in (positive, *rivals))) - positive
        total += attract * (1 - unit @ target)
    return total / len(features)


def focal_twin(logits, mask, alpha=0.25, gamma=2.0):
    """Mean focal loss of one mask, pixel by pixel."""
    total = 0.0
    for logit, inside in zip(logits, mask, strict=True):
        p = 1 / (1 + math.exp(-logit))
        total += (
            -alpha * (1 - p) ** gamma * math.log(p) if inside else -(1 - alpha) * p**gamma * math.log(1 - p)
        )
    return total / len(logits)


def dice_twin(logits, mask):
    """Dice loss of one mask."""
    p = 1 / (1 + np.exp(-logits))
    return 1 - (2 * (p * mask).sum() + 1) / (p.sum() + mask.sum() + 1)


def contrast_twin(features, ids, temperature):
    """`losses.instance_contrast` by loops."""
    units = features / np.linalg.norm(features, axis=1, keepdims=True)
    terms = []
    for p in range(len(ids)):
        others = [j for j in range(len(ids)) if j != p]
        partners = [j for j in others if ids[j] == ids[p]]
        if partners:
            every = sum(math.exp(temperature * units[p] @ units[j]) for j in others)
            same = sum(math.exp(temperature * units[p] @ units[j]) for j in partners)
            terms.append(math.log(every / same))
    return sum(terms) / len(terms)


def ssim_twin(left, right, window=7):
    """SSIM per pixel and channel with reflected edges, window by window."""
    pad = window // 2
    a = np.pad(left, ((pad, pad), (pad, pad), (0, 0)), mode="reflect")
    b = np.pad(right, ((pad, pad), (pad, pad), (0, 0)), mode="reflect")
    result = np.zeros_like(left)
    for y in range(left.shape[0]):
        for x in range(left.shape[1]):
            for c in range(3):
                p, q = a[y : y + window, x : x + window, c], b[y : y + window, x : x + window, c]
                covariance = (p * q).mean() - p.mean() * q.mean()
                top = (2 * p.mean() * q.mean() + 1e-4) * (2 * covariance + 9e-4)
                bottom = (p.mean() ** 2 + q.mean() ** 2 + 1e-4) * (p.var() + q.var() + 9e-4)
                result[y, x, c] = top / bottom
    return result


def plain_training(network, stage, rooms, words, *, steps, pictures):
    """The loop with one batch a step, written down plainly: averaged weights, and the loss of every step.

    AdamW at a rate that warms up over 100 steps and falls as a cosine to a fiftieth, gradients cut to a norm
    of 1, averages that remember up to 500 steps.
    """
    prefixes = tuple(f"{name}." for name in stage.modules)
    network.requires_grad_(False)
    network.eval()
    for name in stage.modules:
        getattr(network, name).requires_grad_(True).train()
    for parameter in network.parameters():
        if parameter.ndim == 4:
            parameter.data = parameter.data.contiguous(memory_format=torch.channels_last)
    own = [p for name in stage.modules for p in getattr(network, name).parameters()]
    optimiser = torch.optim.AdamW(own, lr=1e-6, weight_decay=0.01, betas=(0.9, 0.99))
    averaged = {k: v.clone() for k, v in network.state_dict().items() if k.startswith(prefixes)}
    losses = []
    for step in range(steps):
        sizes, chances = list(stage.views), torch.tensor(list(stage.views.values()))
        views = sizes[int(torch.multinomial(chances, 1, generator=words.generator))]
        batch = rooms.draw(max(1, pictures // views), views, words.generator)
        with mixed_precision("cpu"):
            loss = stage.loss(network, batch, words).total
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(own, 1.0)
        fall = 0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * step / steps))
        optimiser.param_groups[0]["lr"] = stage.learning_rate * min(1.0, (step + 1) / 100) * fall
        optimiser.step()
        decay = min(0.998, (2 + step) / (11 + step))
        for key, value in network.state_dict().items():
            if key in averaged:
                averaged[key].lerp_(value, 1 - decay)
        losses.append(float(loss.detach()))
    return averaged, losses
