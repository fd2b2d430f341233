"""Language for plain splats: views of them through the network, what it sees carried back to the Gaussians.

    views (of the scene itself, or photos with poses) -> network: w_k(x) per view and one dictionary
    -> w_ik = sum c_ip w_k(p) / sum c_ip, with c_ip what Gaussian i adds to pixel p (`splat.backprojection`)

Nothing is trained. What no view shows takes the weights of the nearest Gaussian that one does. Views of the
scene itself are from where people would stand (`scene.lookouts`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial import KDTree
from torch import Tensor

from langflash_core.base.picture_files import encoded
from langflash_core.base.records import Shift
from langflash_core.errors import Cancelled, InputError
from langflash_core.export.cameras import read_posed
from langflash_core.export.png import to_8bit
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.nearness import Nearness
from langflash_core.geometry.turning import axes_matrix
from langflash_core.images.pictures import fitting_size
from langflash_core.images.views import load_views
from langflash_core.level import on_its_head
from langflash_core.network import PRESETS, load_network
from langflash_core.network.posed import posed_semantics
from langflash_core.scene.lookouts import lookouts
from langflash_core.scene.weights import sparse_weights
from langflash_core.splat import render as render_reference
from langflash_core.splat.backprojection import backproject
from langflash_core.splat.compose import shares
from langflash_core.types import Camera, Frame, Scene, Semantics, Views

PRESET = "mini"


@dataclass(frozen=True)
class Lifting:
    """How scenes of others get language."""

    views: int = 8
    """What the network was shaped for."""
    shape: tuple[int, int] = (4, 3)
    """Width to height of a view."""
    grey: float = 0.5
    """Behind what a view shows, as behind transparent photos."""
    covered: float = 0.5
    """Alpha from which a pixel speaks of the scene."""
    blur: int = 5
    """Pixels, odd."""
    fewest_shown: float = 0.02
    """Of a view, to be compared with its photo."""
    flat: float = 0.002
    """Change of brightness from pixel to pixel, of 1: a wall."""
    alike: float = 0.3
    """Likeness below which a photo's pose is in doubt: of right ones it is .86 and more where the scene
    was made of neighbours, of others within .2 of 0."""
    spared: float = 0.25
    """Of the photos may be less alike: somebody walks through them."""
    seen: float = 1e-3
    """Sum of c_ip below which a Gaussian counts as not seen."""
    top: int = 8
    """Weights kept per Gaussian."""
    quality: int = 88
    """Of a photo's JPEG."""


LIFTING = Lifting()
UP = "-y"  # of the world of a `Scene`
_TO_DOWN = {"-y": "RDF", "y": "RUB", "z": "RBD", "-z": "RFU", "x": "DLF", "-x": "URF"}  # turns: +y comes down
UPS = tuple(_TO_DOWN)
Progress = Callable[[str, float], None]
Renderer = Callable[[Scene, Camera], Frame]
Sees = Callable[[Views, Tensor, Tensor], tuple[Tensor, Tensor]]
"""`posed_semantics` of a network: views, poses and depths to weights and a dictionary."""


def lift(
    scene: Scene,
    photos: Views | None = None,
    viewmats: Tensor | None = None,
    *,
    up: str = UP,
    render: Renderer | None = None,
    weights: Path | None = None,
    progress: Progress = lambda _, __: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Scene:
    """A plain scene with groups, a dictionary, and the views that they were seen in.

    Args:
        scene: any; what language it has is replaced. One of layers keeps its photos, which tell them apart.
        photos, viewmats: V views and their poses (V, 4, 4) in the scene's world; None: views of the
            scene itself, around its middle.
        up: the axis of the scene's world that points up, one of `UPS`; for views of itself.
        render: draws colour and depth; None: the reference in torch. weights: a checkpoint of `mini`.
        progress: called with the step and its place in [0, 1]. cancelled: asked between steps and views.

    Raises:
        InputError: the photos show nothing of the scene, or the network sees nothing in the views.
        WeightsError: the checkpoint is missing or does not fit. Cancelled: `cancelled()` became true.
    """
    draw, network = render or render_reference, load_network(PRESET, weights, "cpu")
    told, see = _Telling(progress, cancelled), partial(posed_semantics, network)
    if photos is not None and viewmats is not None:
        cameras = [Camera(v, K, *photos.size) for v, K in zip(viewmats, photos.Ks, strict=True)]
        looked = _look_at_views(scene, cameras, photos, draw, see, told)
        lifted = _add_language(scene, looked, network.calibration)
        told("done", 1.0)
        doubt = _doubt(looked.frames, photos)
        return lifted.with_record(warnings=(*lifted.record.warnings, doubt)) if doubt else lifted
    looked = _look_at_views(scene, own_cameras(scene, LIFTING.views, up), None, draw, see, told)
    told("done", 1.0)
    return _with_hint(_add_language(scene, looked, network.calibration), up)


@dataclass(frozen=True)
class _Telling:
    """Tells how far the work is, and ends it once that is wanted."""

    progress: Progress
    cancelled: Callable[[], bool]

    def __call__(self, step: str, share: float) -> None:
        if self.cancelled():
            raise Cancelled("the lifting was cancelled; nothing was written")
        self.progress(step, share)


@dataclass(frozen=True)
class _Looked:
    """What a network saw: cameras, views and what was drawn of them; sums (N, K) and totals (N,) of what it
    said of each Gaussian, and its dictionary (K, C)."""

    cameras: Sequence[Camera]
    views: Views
    frames: Sequence[Frame]
    sums: Tensor
    totals: Tensor
    dictionary: Tensor

    def shares(self) -> Float[Tensor, "N K"]:
        """Of each Gaussian, in sum 1 where it is seen."""
        return self.sums / self.totals.clamp_min(1e-12)[:, None]


def _look_at_views(
    scene: Scene, cameras: Sequence[Camera], photos: Views | None, draw: Renderer, see: Sees, told: _Telling
) -> _Looked:
    """Draw views, have the network look at them, or at photos from their places, and carry that back."""
    frames = []
    for index, camera in enumerate(cameras):
        told("drawing", 0.3 * index / len(cameras))
        frames.append(draw(scene, camera))
    _check_shown(frames)
    views = photos if photos is not None else own_views(frames, cameras)
    told("network", 0.3)
    depths = torch.stack([frame.depths.float() for frame in frames])
    world = torch.stack([camera.viewmat for camera in cameras])
    unit = float(depths[0][depths[0] > 0].mean())
    relative = (world @ invert_rigid(world[0])).clone()
    relative[:, :3, 3] /= unit
    maps, dictionary = see(views, relative, depths / unit)
    if not len(dictionary):
        raise InputError("the network finds no part in these views; give photos that show more of the scene")
    sums, totals = _carried_back(scene, cameras, maps, frames, draw, told)
    return _Looked(cameras, views, frames, sums, totals, dictionary)


def _with_hint(lifted: Scene, up: str) -> Scene:
    """With a warning, where by its own words it stands on its head."""
    if not on_its_head(lifted, -axes_matrix(_TO_DOWN[up])[1].numpy()):
        return lifted
    other = up[1:] if up.startswith("-") else f"-{up}"
    hint = (
        "What is called floor lies above what is called ceiling, so the scene seems to stand on its head; "
        f"lift it again with --up={other}, or a .spz of SuperSplat with --axes rdf."
    )
    return lifted.with_record(warnings=(*lifted.record.warnings, hint))


def posed_views(poses: Path, photos: Sequence[Path], shift: Shift | None = None) -> tuple[Views, Tensor]:
    """Photos as the network sees them, and their poses (V, 4, 4) in their own world.

    Args:
        poses: a transforms.json, or a COLMAP model. photos: those to take; none: all, at most 8, evenly
            chosen. shift: what was taken off the scene's coordinates, as its record has it; it is taken off
            the poses, too.

    Raises:
        SceneFileError: the poses cannot be used. ImageError: a photo cannot.
    """
    posed = read_posed(poses).of(photos)
    step = 1 if photos else -(-len(posed.paths) // LIFTING.views)
    posed = posed.at(range(0, len(posed.paths), step)).upright()
    preset = PRESETS[PRESET]
    views = load_views(
        posed.paths, area=preset.native_area, multiple=preset.patch, intrinsics=posed.intrinsics
    )
    viewmats = posed.viewmats.clone()
    if shift is not None:
        viewmats[:, :3, 3] += viewmats[:, :3, :3] @ torch.tensor(shift, dtype=viewmats.dtype)
    return views, viewmats.float()


def own_cameras(scene: Scene, count: int, up: str = UP) -> list[Camera]:
    """Cameras of at most `count` views of a scene from where people would stand, upright.

    Args:
        up: the axis of the scene's world that points up, one of `UPS`.
    """
    turn, preset = axes_matrix(_TO_DOWN[up]), PRESETS[PRESET]
    upright = replace(scene.gaussians, means=(scene.gaussians.means.double() @ turn.T).float())
    to_upright = torch.eye(4)
    to_upright[:3, :3] = turn
    size = fitting_size(*LIFTING.shape, preset.native_area, preset.patch)
    return [replace(c, viewmat=c.viewmat @ to_upright) for c in lookouts(upright, count, size)]


def own_views(frames: Sequence[Frame], cameras: Sequence[Camera]) -> Views:
    """Drawn views as photos, over grey."""
    images = []
    for frame in frames:
        grey = frame.rgb + (1 - frame.alphas[..., None]) * LIFTING.grey
        images.append(grey.clamp(0, 1).permute(2, 0, 1).float())
    names = tuple(f"view {number}" for number in range(1, len(frames) + 1))
    Ks = torch.stack([camera.K.float() for camera in cameras])
    pixels = (to_8bit(image.permute(1, 2, 0)) for image in images)
    sources = tuple(encoded(each, "JPEG", quality=LIFTING.quality) for each in pixels)
    return Views(torch.stack(images), Ks, names, sources)


def _check_shown(frames: Sequence[Frame]) -> None:
    """Raises InputError: the first view, or most of them, show nothing."""
    shown = [float((frame.alphas >= LIFTING.covered).float().mean()) for frame in frames]
    if not shown or not shown[0] or sum(share > 0.02 for share in shown) * 2 <= len(shown):
        raise InputError(
            "the views show almost nothing of the scene; check that the poses are in its world and its unit"
        )


def likeness(frame: Frame, photo: Float[Tensor, "3 H W"]) -> float:
    """How alike a drawn view and a photo are, in [-1, 1]: the correlation of their blurred gradients.

    Gradients point to the brighter side, so pictures of different things are near 0 whatever they show;
    light and contrast do not matter. Only where the view shows something; NaN where that is too little,
    or flat.
    """
    weights = torch.tensor((0.299, 0.587, 0.114), dtype=torch.float32)
    drawn = frame.rgb.float().cpu() / frame.alphas.float().cpu().clamp_min(LIFTING.covered)[..., None]
    greys = _blur(torch.stack((drawn @ weights, photo.float().cpu().permute(1, 2, 0) @ weights)))
    covered = _blur((frame.alphas.cpu() >= LIFTING.covered).float()[None])[0, 1:, 1:] > 1 - 1e-3
    if float(covered.float().mean()) < LIFTING.fewest_shown:
        return math.nan
    across, down = greys[:, 1:, 1:] - greys[:, 1:, :-1], greys[:, 1:, 1:] - greys[:, :-1, 1:]
    gradients = torch.stack((across, down), -1)[:, covered].double()  # (2, n, 2)
    sizes = gradients.square().sum(-1).mean(1).sqrt()  # (2,)
    if float(sizes.min()) < LIFTING.flat:
        return math.nan
    return float(gradients.prod(0).sum(-1).mean() / sizes.prod())


def _blur(pictures: Float[Tensor, "n H W"]) -> Float[Tensor, "n H W"]:
    """By `LIFTING.blur` pixels, twice, which forgives poses a few pixels."""
    for _ in range(2):
        pictures = torch.nn.functional.avg_pool2d(
            pictures[:, None], LIFTING.blur, 1, LIFTING.blur // 2, count_include_pad=False
        )[:, 0]
    return pictures


def _doubt(frames: Sequence[Frame], views: Views) -> str:
    """What a person is told where more than a quarter of the photos do not show what is drawn from their
    poses, or nothing."""
    found = [likeness(frame, photo) for frame, photo in zip(frames, views.images, strict=True)]
    known = [each for each in found if not math.isnan(each)]
    low = float(np.quantile(known, LIFTING.spared, method="lower")) if known else 1.0
    if low >= LIFTING.alike:
        return ""
    return (
        f"the photos do not look like the scene from their poses (likeness {low:.2f} of 1); "
        "check that the poses are in its world and its unit"
    )


def _carried_back(
    scene: Scene,
    cameras: Sequence[Camera],
    maps: Tensor,
    frames: Sequence[Frame],
    draw: Renderer,
    told: _Telling,
) -> tuple[Tensor, Tensor]:
    """Sums (N, K) and totals (N,) over all views."""
    sums = torch.zeros(len(scene.gaussians), maps.shape[1])
    totals = torch.zeros(len(scene.gaussians))
    for index, (camera, values, frame) in enumerate(zip(cameras, maps, frames, strict=True)):
        told("carrying back", 0.6 + 0.4 * index / len(cameras))
        trust = (frame.alphas >= LIFTING.covered).float()
        for rows, counts in _contributions(scene, camera, draw):
            some = scene.gaussians.rows(rows)
            own, count = backproject(some, camera, values.permute(1, 2, 0), trust * counts)
            sums[rows] += own
            totals[rows] += count
    return sums, totals


def _contributions(scene: Scene, camera: Camera, draw: Renderer) -> list[tuple[Tensor, Tensor]]:
    """Rows (n,) of what makes up a picture, and what it counts in each pixel (H, W): all of the scene, or
    each of the layers that are blended."""
    chosen = Nearness.of(scene).chosen(camera) if scene.layered else None
    if chosen is None or not chosen.views or scene.view_ids is None:
        return [(torch.arange(len(scene.gaussians)), torch.ones(camera.height, camera.width))]
    frames = [draw(scene.layer(view), camera) for view in chosen.views]
    alphas, depths = (torch.stack([getattr(f, n).float() for f in frames]) for n in ("alphas", "depths"))
    rows = [((scene.view_ids == view) | (scene.view_ids < 0)).nonzero()[:, 0] for view in chosen.views]
    return list(zip(rows, shares(alphas.cpu(), depths.cpu(), chosen.weights), strict=True))


def _add_language(scene: Scene, looked: _Looked, calibration: dict) -> Scene:
    """The scene with its language."""
    seen = looked.totals >= LIFTING.seen
    if not bool(seen.any()):
        raise InputError("no view shows a Gaussian of the scene; check the poses")
    ids, values = sparse_weights(looked.shares(), LIFTING.top)
    hidden = (~seen).nonzero()[:, 0]
    if len(hidden):
        rows = seen.nonzero()[:, 0]
        means = scene.gaussians.means.double().numpy()
        nearest = rows[torch.from_numpy(np.asarray(KDTree(means[seen]).query(means[~seen])[1]))]
        ids[hidden], values[hidden] = ids[nearest], values[nearest]
    # What is known of atoms and of photos that are no more.
    plain = scene.with_record(atom_names={}, atom_denials={}, silent_atoms=(), lone_atoms=())
    told = {"preset": PRESET, "calibration": dict(calibration)}
    counts = {**scene.record.counts, "seen": int(seen.sum())}
    spoken = replace(plain, semantics=Semantics(ids, values, looked.dictionary, PRESETS[PRESET].space))
    if scene.layered:
        return spoken.with_record(**told, counts=counts)
    lifted = replace(
        spoken,
        viewmats=torch.stack([camera.viewmat.float() for camera in looked.cameras]),
        Ks=looked.views.Ks.float(),
        view_size=looked.views.size,
        photos=looked.views.sources,
        view_ids=None,
    )
    return lifted.with_record(**told, counts=counts, photos=tuple(looked.views.names), light={}, foreseen={})
