"""Which pixels a stage looks at: instance maps at other sizes, draws in which small things have a share."""

import torch
from torch import Tensor


def balanced_pixels(ids: Tensor, weights: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """Flat indices (count,) of pixels of an instance map (h, w), drawn with chance
    weights[instance] / sqrt(its area); fewer instances' pixels may repeat; empty if nothing is labelled."""
    flat = ids.flatten().cpu()
    labelled = (flat < len(weights)).nonzero().squeeze(-1)
    if len(labelled) == 0:
        return labelled.to(ids.device)
    areas = torch.bincount(flat[labelled], minlength=len(weights)).float()
    chance = (weights * areas.clamp_min(1).rsqrt())[flat[labelled]]
    drawn = torch.multinomial(chance, count, replacement=True, generator=generator)
    return labelled[drawn].to(ids.device)


def evenly_drawn(rows: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """Indices of at most `count` entries of `rows` (P,) on the CPU that are not negative, drawn again and
    again with chance 1 / sqrt(how many bear the same number); empty if none is."""
    chosen = (rows >= 0).nonzero()[:, 0]
    if not len(chosen):
        return chosen
    chance = torch.bincount(rows[chosen]).float()[rows[chosen]].rsqrt()
    return chosen[torch.multinomial(chance, min(count, len(chosen)), True, generator=generator)]


def nearest(ids: Tensor, size: tuple[int, int]) -> Tensor:
    """An instance map (..., H, W) at another size, by the nearest pixel centre; never mixes ids."""
    height, width = ids.shape[-2:]
    ys = ((torch.arange(size[0], device=ids.device) + 0.5) * height / size[0]).long()
    xs = ((torch.arange(size[1], device=ids.device) + 0.5) * width / size[1]).long()
    return ids[..., ys[:, None], xs]
