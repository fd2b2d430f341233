"""How much of a photo a drawn picture shows, whatever its light: for real walks, whose mean of squared errors
hides fog. Pictures are (H, W, 3) in [0, 1]; NaN where nothing can be measured.
"""

import math

from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.evaluation.sharp_measures import FLAT, check_pictures, grey_of
from langflash_core.lab.evaluation.walk_measures import lit
from langflash_core.lab.training.measures import psnr

_WINDOW = 7
"""Pixels, the side of what is around a pixel: a table's leg, and not the table."""
_FOGGED = 0.25
"""Of the photo's own local contrast, below which a pixel is fog."""


def in_its_light(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> Float[Tensor, "H W 3"]:
    """What is drawn in the photo's light: a gain and an offset a channel, by least squares, within [0, 1]."""
    return lit(drawn.reshape(-1, 3), photo.reshape(-1, 3)).reshape(drawn.shape).clamp(0, 1)


def structure(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> float:
    """Correlation of the horizontal differences of grey: 1 of the photo itself, about .3 and less of fog."""
    check_pictures(drawn, photo)
    ours, theirs = (grey_of(picture).diff(dim=1).double().flatten() for picture in (drawn, photo))
    ours, theirs = ours - ours.mean(), theirs - theirs.mean()
    norms = float(ours.norm() * theirs.norm())
    return float(ours @ theirs) / norms if norms > 0 else math.nan


def fog(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> float:
    """Share of the pixels around which the photo is no flat wall, where what is drawn has less than a quarter
    of its contrast: the standard deviation of grey in 7 x 7 pixels."""
    check_pictures(drawn, photo)
    made, truth = _contrast(drawn), _contrast(photo)
    textured = truth >= FLAT
    return float((made < _FOGGED * truth)[textured].float().mean()) if bool(textured.any()) else math.nan


def _contrast(picture: Tensor) -> Tensor:
    """(h, w) of the whole windows."""
    side = min(_WINDOW, *picture.shape[:2])
    windows = F.unfold(grey_of(picture).double()[None, None], side)[0]  # (side^2, h w)
    return windows.std(0, correction=0)


def likeness(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> dict[str, float]:
    """PSNR in the photo's light, structure and fog."""
    shown = in_its_light(drawn, photo)
    return {
        "psnr": psnr(shown, photo),
        "structure": structure(drawn, photo),
        "fog": fog(shown, photo),
    }
