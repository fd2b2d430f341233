"""Scenes of nothing but Gaussians, as splat files hold them: no photos, no words, one view that frames them.

Nobody says where such a scene is best looked at from, or which way is up. Two cases are told apart:
what lies in one cone ahead of the origin was predicted from photos there (as `langflash export`
writes it) and is seen from the origin; anything else is looked at from outside, along +z, with +y
down as in the field's captures. Medians choose the box to frame: floaters and far backgrounds are
many and wide in captured scenes, and must not push the camera away.
"""

import math

import torch
from jaxtyping import Float, Integer
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.geometry.pinhole import from_pixels
from langflash_core.scene.settings import BARE_VIEWS
from langflash_core.types import NO_LANGUAGE, Camera, Gaussians, Record, Scene, Semantics


def bare_scene(gaussians: Gaussians, source: str, warnings: tuple[str, ...] = ()) -> Scene:
    """A scene without language and photos: K = 0, C = 0, m = 0, one view that frames it.

    Args:
        gaussians: N >= 1. source: file name for people. warnings: one sentence each.
    """
    count = len(gaussians)
    semantics = Semantics(
        weight_ids=torch.zeros(count, 0, dtype=torch.int64),
        weight_values=torch.zeros(count, 0),
        dictionary=torch.zeros(0, 0),
        space=NO_LANGUAGE,
    )
    camera = framing_camera(gaussians)
    return Scene(
        gaussians,
        semantics,
        viewmats=camera.viewmat[None],
        Ks=camera.K[None],
        view_size=BARE_VIEWS.view_size,
        record=Record(source=source, warnings=warnings),
    )


def framing_camera(gaussians: Gaussians) -> Camera:
    """A camera of `BARE_VIEWS.view_size` that shows most of the Gaussians, N >= 1."""
    rows = seen_rows(gaussians)
    means = gaussians.means[rows].double().cpu()
    widths = gaussians.scales[rows].double().cpu().amax(-1)
    return _from_origin(means) or _from_outside(means, float(widths.median()))


def seen_rows(gaussians: Gaussians) -> Integer[Tensor, " n"]:
    """Numbers of some Gaussians that one sees, at most `BARE_VIEWS.most`, evenly chosen; n >= 1."""
    rows = torch.arange(0, len(gaussians), max(1, len(gaussians) // BARE_VIEWS.most))
    seen = (gaussians.opacities[rows] >= BARE_VIEWS.seen).cpu()
    return rows[seen] if bool(seen.any()) else rows


def middle_box(means: Float[Tensor, "n 3"]) -> tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]]:
    """Two corners of what lies around the median: floaters and far backgrounds are outside."""
    middle = means.quantile(0.5, dim=0)
    reach = BARE_VIEWS.deviations * (means - middle).abs().quantile(0.5, dim=0)
    ordered = means.sort(dim=0).values
    low = torch.maximum(middle - reach, ordered[round(0.01 * (len(means) - 1))])
    return low, torch.minimum(middle + reach, ordered[round(0.99 * (len(means) - 1))])


def _from_origin(means: Tensor) -> Camera | None:
    """The first photo's camera, where all lies ahead of it; None where it does not."""
    if not in_one_cone(means):
        return None
    ahead = means[:, 2] > 0
    slopes = means[:, :2].abs() / means[:, 2:].clamp_min(1e-12)  # (n, 2)
    width, height = BARE_VIEWS.view_size
    across, down = (_at_share(slope[ahead], BARE_VIEWS.shown) for slope in slopes.unbind(-1))
    widest = max(across, down * width / height, math.tan(math.radians(15)))
    fov = 2 * math.degrees(math.atan(widest))
    return Camera(torch.eye(4), intrinsics_from_fov(fov, width, height), width, height)


def in_one_cone(means: Tensor) -> bool:
    """Whether nearly all of means (n, 3) lie ahead of the origin, along +z, as what photos there predict."""
    slopes = means[:, :2].abs() / means[:, 2:].clamp_min(1e-12)
    inside = (means[:, 2] > 0) & (slopes < BARE_VIEWS.cone).all(-1)
    return float(inside.double().mean()) >= BARE_VIEWS.in_cone


def _from_outside(means: Tensor, width: float) -> Camera:
    """Ahead of the middle box of means (n, 3), which is never thinner than their median `width`."""
    low, high = middle_box(means)
    centre = (low + high) / 2
    half = BARE_VIEWS.margin * ((high - low) / 2).clamp_min(3 * width)
    sine, cosine = math.sin(BARE_VIEWS.elevation), math.cos(BARE_VIEWS.elevation)
    axes = torch.tensor([[1.0, 0, 0], [0, cosine, -sine], [0, sine, cosine]], dtype=torch.float64)
    signs = torch.cartesian_prod(*[torch.tensor([-1.0, 1.0], dtype=torch.float64)] * 3)
    corners = (signs * half) @ axes.T  # (8, 3), camera axes, around the centre
    K = intrinsics_from_fov(BARE_VIEWS.fov, *BARE_VIEWS.view_size)
    tangents = from_pixels(torch.tensor(BARE_VIEWS.view_size), K)
    distance = float((corners[:, :2].abs() / tangents - corners[:, 2:]).max())
    viewmat = torch.eye(4)
    viewmat[:3, :3] = axes
    place = torch.tensor([0, 0, distance], dtype=torch.float64) - axes @ centre
    viewmat[:3, 3] = place.clamp(-BARE_VIEWS.farthest, BARE_VIEWS.farthest)
    return Camera(viewmat, K, *BARE_VIEWS.view_size)


def _at_share(values: Tensor, share: float) -> float:
    """The value that `share` of (n,) values stay below, by rank."""
    return float(values.sort().values[round(share * (len(values) - 1))])
