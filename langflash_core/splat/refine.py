"""Photometric refinement of a finished scene: poses and looks are fitted to its own photos.

The forward pass needs no optimisation; this is an option after it, for people with seconds to
spare. It is judged on a view it never saw: a trial leaves out one photo and the Gaussians that
came from it, fits the rest, and is compared with that photo where the start covers it. Only a
trial that comes closer is repeated with all photos; otherwise the scene stays as it was.

V views, N Gaussians, S spherical-harmonic bases, H W pixels.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.splat.projection import NEAR, view_colours
from langflash_core.splat.reference import rasterize
from langflash_core.types import Camera, Gaussians, Scene

# Adam's steps. Poses: about a tenth of a pixel at 250 pixels for one scene unit; colours: three of 255
# steps. Kerbl et al. 2023 take smaller ones; seconds on a processor are tens of steps, not thousands.
# Means stay where depth put them: moved as well, each for itself, they came closer to their own photos
# (1.6 dB more) and not to held-out ones (25.05 against 25.19 dB over four generated rooms), and left
# surfaces that speckle twice as much under magnification.
RATES = {
    "quats": 2e-3,
    "log_scales": 1e-2,
    "logit_opacities": 5e-2,
    "sh": 1e-2,
    "twists": 5e-4,
}
_COVERED = 0.5  # alpha from which a pixel counts as shown by the start
_MIN_COVERED = 0.05  # of the held-out view; less says nothing about it


@dataclass(frozen=True)
class Refinement:
    """What came of it. PSNR in dB: `held_out` of the view `view` in the trial, `photos` over all
    photos of the scene given back, both before and after; steps of trial and fit; kept: it helped."""

    scene: Scene
    kept: bool
    view: int
    held_out: tuple[float, float]
    photos: tuple[float, float]
    steps: tuple[int, int]

    def recorded(self) -> "Refinement":
        """The same, with what came of it in the scene's record."""
        told = {
            "kept": self.kept,
            "held_out": self.scene.record.photos[self.view] if self.scene.record.photos else str(self.view),
            "held_out_psnr_db": [round(value, 2) for value in self.held_out],
            "photos_psnr_db": [round(value, 2) for value in self.photos],
            "steps": list(self.steps),
        }
        return replace(self, scene=self.scene.with_record(refinement=told))


@dataclass(frozen=True)
class Budget:
    """Where a fit stops: after so many seconds, and after so many steps at the latest."""

    seconds: float
    steps: int = 2000


def refine(
    scene: Scene, photos: Float[Tensor, "V 3 H W"], budget: Budget, report: Progress | None = None
) -> Refinement:
    """The scene fitted to its photos, if that brings a held-out view closer to its photo.

    Args:
        scene: with `view_ids`. photos: (V, 3, H, W) in the scene's light, at
            `view_size`. budget: half of it for the trial, half for the fit with all photos.
        report: called with what is done and the fraction in [0, 1].

    Raises:
        InputError: fewer than two views, or a held-out view that the others hardly cover.
        ValueError: photos and views disagree, or nobody knows which view made which Gaussian.
    """
    if scene.num_views < 2:
        raise InputError("a refinement compares photos with each other; give at least two that overlap")
    if photos.shape != (scene.num_views, 3, scene.view_size[1], scene.view_size[0]):
        raise ValueError(f"photos: expected {scene.num_views} of {scene.view_size}, received {photos.shape}")
    photos = photos.to(scene.gaussians.means)
    half = replace(budget, seconds=budget.seconds / 2, steps=math.ceil(budget.steps / 2))
    view = scene.num_views // 2
    others = [v for v in range(scene.num_views) if v != view]
    start = _without(scene, view)
    shown = _draw(start.gaussians, start.camera(view))[1] >= _COVERED
    if float(shown.float().mean()) < _MIN_COVERED:
        raise InputError("the photos overlap too little to judge a refinement; leave --refine out")
    tried, first = _fit(start, photos, others, half, _share(report, "trial", 0.0))
    held_out = (_view_psnr(start, view, photos, shown), _view_psnr(tried, view, photos, shown))
    before = _mean_psnr(scene, photos)
    if held_out[1] <= held_out[0]:
        return Refinement(scene, False, view, held_out, (before, before), (first, 0))
    fitted, second = _fit(scene, photos, range(scene.num_views), half, _share(report, "fit", 0.5))
    return Refinement(fitted, True, view, held_out, (before, _mean_psnr(fitted, photos)), (first, second))


def psnr(rgb: Float[Tensor, "H W 3"], photo: Float[Tensor, "3 H W"], shown: Bool[Tensor, "H W"]) -> float:
    """dB over the pixels `shown` (H, W); rgb (H, W, 3), photo (3, H, W). Equal pictures give 100."""
    error = (rgb.detach().clamp(0, 1) - photo.movedim(0, -1).clamp(0, 1))[shown].square().mean()
    return -10 * math.log10(max(float(error), 1e-10))


@torch.no_grad()
def _view_psnr(scene: Scene, view: int, photos: Tensor, shown: Tensor) -> float:
    return psnr(_draw(scene.gaussians, scene.camera(view))[0], photos[view], shown)


def _mean_psnr(scene: Scene, photos: Tensor) -> float:
    everywhere = torch.ones_like(photos[0, 0], dtype=torch.bool)
    return sum(_view_psnr(scene, v, photos, everywhere) for v in range(len(photos))) / len(photos)


def _without(scene: Scene, view: int) -> Scene:
    """The scene without the Gaussians that came from one view; its camera stays."""
    if scene.view_ids is None:
        raise ValueError("view_ids: expected the view that made each Gaussian, received none")
    return scene.rows(scene.view_ids != view)


def _fit(
    scene: Scene, photos: Tensor, views: list[int] | range, budget: Budget, report: Progress
) -> tuple[Scene, int]:
    """Poses (but the first view's, which is the world), shapes, opacities and colours fitted to some
    photos; steps taken."""
    values = _leaves(scene)
    adam = torch.optim.Adam([{"params": [v], "lr": RATES[name]} for name, v in values.items()], eps=1e-15)
    narrowest = values["log_scales"].detach().clone()
    start, steps = time.perf_counter(), 0
    for view in _rounds(views):
        spent = (time.perf_counter() - start) / budget.seconds
        if spent >= 1 or steps >= budget.steps:
            break
        report(f"step {steps}", max(spent, steps / budget.steps))
        now = _scene_of(scene, values)
        rgb, _ = _draw(now.gaussians, now.camera(view))
        loss = (rgb - photos[view].movedim(0, -1)).abs().mean()
        adam.zero_grad()
        loss.backward()
        _keep_finite(values)
        adam.step()
        with torch.no_grad():  # narrower ones sharpen their own photo and leave gaps in every other view
            values["log_scales"].clamp_(min=narrowest)
        steps += 1
    return _scene_of(scene, {name: value.detach() for name, value in values.items()}), steps


def _rounds(views: list[int] | range) -> Iterator[int]:
    while True:
        yield from views


def _leaves(scene: Scene) -> dict[str, Tensor]:
    """Unbounded twins of everything that is fitted; twists are zero: the poses as they are."""
    g = scene.gaussians
    values = {
        "quats": g.quats,
        "log_scales": g.scales.log(),
        "logit_opacities": g.opacities.clamp(1e-4, 1 - 1e-4).logit(),
        "sh": g.sh,
        "twists": g.means.new_zeros(scene.num_views, 6),
    }
    return {name: value.detach().clone().requires_grad_() for name, value in values.items()}


def _scene_of(scene: Scene, values: dict[str, Tensor]) -> Scene:
    gaussians = Gaussians(
        scene.gaussians.means, normalize(values["quats"], dim=-1), values["log_scales"].exp(),
        values["logit_opacities"].sigmoid(), values["sh"],
    )  # fmt: skip
    return replace(
        scene, gaussians=gaussians, viewmats=_moved(scene.viewmats.to(values["twists"]), values["twists"])
    )


def _moved(viewmats: Tensor, twists: Tensor) -> Tensor:
    """exp(twist) viewmat, (V, 4, 4), twists (V, 6) = turn, shift; the first view does not move."""
    x, y, z = twists[:, :3].unbind(-1)
    none = torch.zeros_like(x)
    turns = torch.stack((none, -z, y, z, none, -x, -y, x, none), -1).unflatten(-1, (3, 3))
    algebra = torch.cat((torch.cat((turns, twists[:, 3:, None]), 2), torch.zeros_like(viewmats[:, :1])), 1)
    return torch.cat((viewmats[:1], torch.linalg.matrix_exp(algebra[1:]) @ viewmats[1:]))


def _keep_finite(values: dict[str, Tensor]) -> None:
    """A Gaussian at the camera's edge may have an endless gradient; it then stays for this step."""
    for value in values.values():
        if value.grad is not None:
            value.grad.nan_to_num_(0.0, 0.0, 0.0)


def _draw(gaussians: Gaussians, camera: Camera) -> tuple[Tensor, Tensor]:
    """Colours (H, W, 3) over black and alphas (H, W): by gsplat on CUDA, else by the reference."""
    colours = view_colours(gaussians, camera)
    if not (gaussians.means.is_cuda and find_spec("gsplat")):
        return rasterize(gaussians, colours, camera)
    from gsplat import rasterization  # type: ignore[import-not-found]

    pictures, alphas, _ = rasterization(
        gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, colours,
        camera.viewmat[None], camera.K[None], camera.width, camera.height, near_plane=NEAR,
    )  # fmt: skip
    return pictures[0], alphas[0, ..., 0]


def _share(report: Progress | None, name: str, start: float) -> Progress:
    """Progress of one half of the whole."""
    if report is None:
        return lambda step, fraction: None
    return lambda step, fraction: report(f"{name}, {step}", start + fraction / 2)
