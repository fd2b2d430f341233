"""Which Gaussians phrases mean, whatever the view: `language/narrowing.py` among the connected things of a
scene, as the first photo sees them.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from langflash_core.errors import PromptError
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.surfels import covered_areas
from langflash_core.language.gaussians import gaussian_relevance
from langflash_core.language.looks import lab, room_white
from langflash_core.language.narrowing import Sight, choose, likely, viewer_axes
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.spaces import language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.scene.instances import parts_of
from langflash_core.scene.world import upward
from langflash_core.types import Scene


@torch.no_grad()
def meant_relevance(
    scene: Scene, compiled: CompiledQuery, limits: Sequence[float]
) -> tuple[Float[Tensor, "P N"], tuple[str, ...]]:
    """Relevance of P phrases to N Gaussians, 0 where those belong to what the phrases do not mean; and what
    people should know of each phrase, or "".

    Args:
        limits: thresholds (P,), from which on a Gaussian answers a head.
    """
    relevance = gaussian_relevance(scene.semantics, compiled)
    notes = compiled.notes or ("",) * len(relevance)
    if not compiled.narrows:
        return relevance, notes
    others = {}
    if compiled.others is not None:
        found = gaussian_relevance(scene.semantics, compiled.others).cpu().numpy()
        others = dict(zip(compiled.others.texts, found, strict=True))
    sight, told = _sight(scene), list(notes)
    for row, (reading, limit) in enumerate(zip(compiled.readings, limits, strict=True)):
        if reading.narrows:
            own = {**others, reading.head: relevance[row].cpu().numpy()}
            choice = choose(reading, sight.asked(own, limit, likely(limit, compiled.mode)))
            kept = torch.zeros(relevance.shape[1], dtype=torch.bool, device=relevance.device)
            for thing in choice.kept:
                kept[torch.from_numpy(thing.rows)] = True
            relevance[row] *= kept
            told[row] = "; ".join(filter(None, (told[row], choice.note)))
    return relevance, tuple(told)


def answering(scene: Scene, phrases: Sequence[str], threshold: float | None = None) -> Bool[np.ndarray, " N"]:
    """Gaussians that answer at least one of some phrases, whatever the view.

    Args:
        threshold: relevancy in [0, 1]; None: the scene's calibration.

    Raises:
        PromptError: none does, or a phrase or the threshold cannot be used. WeightsError: the space has no
        text weights.
    """
    compiled = compile_spoken(scene, language_space(scene.semantics.space), list(phrases))
    limit = compiled.threshold if threshold is None else threshold
    check_threshold(limit)
    best = meant_relevance(scene, compiled, [limit] * len(phrases))[0].amax(0)
    found = (best >= limit).cpu().numpy() & (scene.semantics.num_atoms > 0)
    if not found.any():
        highest = float(best.max()) if len(best) else 0.0
        raise PromptError(
            f"nothing in the scene answers {', '.join(phrases)} (best score {highest:.3f}, "
            f"threshold {limit:.3f}); ask another phrase, or lower the threshold"
        )
    return found


def check_threshold(threshold: float) -> None:
    """
    Raises:
        PromptError: it is no relevancy.
    """
    if not 0 <= threshold <= 1:
        raise PromptError(f"the threshold {threshold} is out of range; relevancy needs 0 to 1")


def _sight(scene: Scene) -> Sight:
    """The scene's Gaussians, nothing asked yet."""
    camera = scene.camera(0)
    axes = viewer_axes(camera.viewmat, upward(scene.record.world))
    eye = camera.viewmat.double().inverse()[:3, 3].cpu().numpy()
    means = scene.gaussians.means.detach().double().cpu().numpy()
    rgb = (0.5 + SH_C0 * scene.gaussians.sh[:, 0].detach().double().cpu()).numpy()
    areas = covered_areas(scene.gaussians)
    return Sight(
        points=(means - eye) @ axes.T,
        colours=lab(rgb, room_white(rgb)),
        areas=areas / max(float(areas.sum()), 1e-30),
        relevance={},
        limit=1.0,
        likely=1.0,
        parts=lambda members: parts_of(scene, members)[0],
    )
