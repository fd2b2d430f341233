"""Phrases as parts of the scene: which Gaussians, which connected things, and how every view shows them.

Membership is decided once, in 3D, so masks of all views agree. A view's mattes are splatted like weight
maps: with b_ip = 1 where Gaussian i is of phrase p,

    matte_p(x) = sum_i T_i alpha_i b_ip,   cut-out_p(x) = sum_i T_i alpha_i b_ip c_i / matte_p(x),

so an edge has the thing's own colour, whatever stands behind or before it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from langflash_core.export import open_scene
from langflash_core.geometry.fusion import ColouredView, Surface, fuse
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.surfels import covered_areas
from langflash_core.language.answers import oriented_box
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.meant import check_threshold, meant_relevance
from langflash_core.scene.instances import disc_radii, things
from langflash_core.splat.visibility import seen_shares
from langflash_core.types import Camera, Frame, Record, Scene, SegmentedView, Segments, Semantics

Render = Callable[..., Frame]  # (scene, camera, weight_maps=True)
_LEAST = 1 / 255  # of a matte that has a colour
_SAMPLES = 20_000  # of a surface, at most: quantiles need no more


def segment(
    scene: Scene | Path | str, prompts: Sequence[str] | str, *, threshold: float | None = None
) -> Segments:
    """The Gaussians that answer each phrase, and the connected things among them.

    A phrase is found where some photo shows what answers it with `ANSWERING.min_area` of its pixels.
    Connected things that no photo shows so large are no things, be they small or hidden behind others; but
    the one that is shown best always is. Of what is not found, nothing is a member. Of a thing those are that
    a mask has (`language/answers.py`), by the thing's own score: a less sure door stays whole.

    Args:
        scene: or the path of one. prompts: phrases, or one.
        threshold: relevancy in [0, 1]; None: the scene's calibration.

    Raises:
        PromptError: a prompt or the threshold cannot be used. WeightsError: the space has no text weights.
    """
    scene, prompts = open_scene(scene), [prompts] if isinstance(prompts, str) else prompts
    compiled = compile_spoken(scene, language_space(scene.semantics.space), list(prompts))
    limit = compiled.threshold if threshold is None else threshold
    check_threshold(limit)
    relevance, _ = meant_relevance(scene, compiled, [limit] * len(prompts))  # (P, N)
    relevance, shares = relevance.cpu(), photo_shares(scene)  # (V, N)
    mean = shares.mean(0)
    scores = _scores(relevance, mean).tolist()
    lit = [ANSWERING.lit_from(score, limit) if threshold is None else limit for score in scores]
    members = (relevance >= torch.tensor(lit).clamp_max(limit)[:, None]) & (scene.semantics.num_atoms > 0)
    numbers = torch.stack([connected_things(scene, row, shares) for row in members])
    if threshold is None:
        for row, least in enumerate(lit):
            members[row] &= relevance[row] >= _lit_from(numbers[row], relevance[row], mean, limit, least)
            numbers[row] = _renumbered(numbers[row] * members[row])
    members &= (numbers > 0).any(1, keepdim=True)
    return Segments(compiled.texts, tuple(scores), float(limit), members, numbers)


def photo_shares(scene: Scene) -> Tensor:
    """(V, N) of the photos that each Gaussian makes up; of the scene's surface, (1 or V, N), what no photo is
    known of."""
    areas = torch.from_numpy(covered_areas(scene.gaussians)).float()
    if scene.view_ids is None:
        return (areas / areas.sum().clamp_min(1e-30))[None]
    unknown = scene.view_ids.cpu() < 0
    # A surface is there once in each of the layers that show it.
    total = areas[unknown].sum() + areas[~unknown].sum() / (scene.num_views if scene.layered else 1)
    areas, seen = (areas / total.clamp_min(1e-30))[None], seen_shares(scene)
    # What fills a hole of all layers is seen in photos, as what a merge put beside them is not.
    return torch.where(unknown, torch.maximum(areas, seen) if scene.layered else areas, seen)


def connected_things(scene: Scene, members: Tensor, shares: Tensor) -> Tensor:
    """(N,) numbers of `things`, without those that no photo shows well enough; 0 where that is all."""
    numbers = torch.from_numpy(things(scene, members.numpy()))
    if not numbers.any() or float(shares[:, members].sum(1).max()) < ANSWERING.min_area:
        return torch.zeros_like(numbers)
    shown = shares.new_zeros(len(shares), int(numbers.max()) + 1).index_add_(1, numbers, shares).amax(0)
    kept = shown >= min(ANSWERING.min_area, float(shown[1:].max()))
    kept[0] = False  # of no thing
    return torch.where(kept, kept.cumsum(0), 0)[numbers]


def _lit_from(numbers: Tensor, relevance: Tensor, shares: Tensor, limit: float, least: float) -> Tensor:
    """(N,) relevancy from which Gaussians belong to the things so numbered, each by its own score; crumbs to
    none, from `least` on."""
    each, top = torch.full_like(relevance, least), float(ANSWERING.top_fraction * shares.sum())
    counts = numbers.bincount().tolist()
    for rows in numbers.argsort(stable=True).split(counts)[1:]:
        (score,) = _best(relevance[None, rows], shares[rows], top).tolist()
        each[rows] = ANSWERING.lit_from(score, limit)
    return each


def _renumbered(numbers: Tensor) -> Tensor:
    """The same from 1 on without gaps, 0 stays."""
    return torch.cat((numbers.new_zeros(1), numbers)).unique(return_inverse=True)[1][1:]


def _scores(relevance: Tensor, shares: Tensor) -> Tensor:
    """(P,) mean relevancy of what answers best, as much as makes up `ANSWERING.top_fraction` of all shares
    (N,)."""
    if not float(shares.sum()) > 0:
        return relevance.new_zeros(len(relevance))
    return _best(relevance, shares, float(ANSWERING.top_fraction * shares.sum()))


def _best(relevance: Tensor, shares: Tensor, top: float) -> Tensor:
    """(P,) means of what answers best, as much as makes up `top` of shares (n,), or all there is."""
    best, order = relevance.sort(dim=1, descending=True)
    own = shares[order]
    left = top - (own.cumsum(1) - own)
    taken = torch.minimum(own, left.clamp_min(0))
    return (best * taken).sum(1) / taken.sum(1)


def boxes(scene: Scene, segments: Segments) -> list[dict]:
    """Oriented box (`oriented_box`) of every connected thing's surface, in the order of `things`."""
    means, areas = scene.gaussians.means.detach().cpu(), covered_areas(scene.gaussians)
    found = []
    for phrase, number in segments.things:
        rows = (segments.instances[phrase] == number).numpy().nonzero()[0]
        found.append(oriented_box(means[torch.from_numpy(rows[evenly(areas[rows])])]))
    return found


def evenly(areas: np.ndarray) -> np.ndarray:
    """Rows, each as often as its area (n,) has it: their quantiles are those of the surface. Where all areas
    are the same, or 0, each of few rows once."""
    ends = np.cumsum(areas if areas.sum() > 0 else np.ones_like(areas))
    count = min(_SAMPLES, len(areas) * max(1, _SAMPLES // 10 // len(areas)))
    places = (np.arange(count) + 0.5) / count * ends[-1]
    return np.searchsorted(ends, places).clip(max=len(areas) - 1)


def segmented_view(scene: Scene, segments: Segments, camera: Camera, render: Render) -> SegmentedView:
    """How a view shows the phrases; `scene` as `carrying` gives it, made once for all views."""
    frame = render(scene, camera)
    maps = frame.weight_maps
    assert maps is not None, "render draws weight maps unless told otherwise"
    count, num_things = len(segments.prompts), len(segments.things)
    mattes, union, parts = maps.movedim(-1, 0).clamp(0, 1).split((count, 1, num_things))
    none, frame = torch.zeros_like(union[0]).long(), replace(frame, weight_maps=None)
    view = SegmentedView(camera, frame, mattes, union[0], none)
    if not num_things:
        return view
    phrases = torch.tensor([phrase for phrase, _ in segments.things])
    most = torch.where(view.masks[phrases] & (2 * parts >= mattes[phrases]), parts, 0.0)
    best, which = most.max(0)
    return replace(view, things=torch.where(best > 0, which + 1, 0))


def carrying(scene: Scene, segments: Segments) -> Scene:
    """The scene with membership for weights: atoms are the phrases, their union, then the things."""
    count = len(segments.prompts)
    union = segments.members.any(0)
    # The atom of each phrase's first thing.
    first = torch.tensor([0, *segments.counts[:-1]]).cumsum(0) + count + 1
    numbers = segments.instances.T  # (N, P)
    parts = torch.where(numbers > 0, first + numbers - 1, 0)
    ids = torch.cat((torch.arange(count + 1).expand(len(union), -1), parts), 1)
    values = torch.cat((segments.members.T, union[:, None], numbers > 0), 1).float()
    atoms = torch.ones(count + 1 + len(segments.things), 1)
    # names and silences are of the scene's own atoms
    plain = replace(scene, record=Record(layered=scene.record.layered))
    return replace(plain, semantics=Semantics(ids, values, atoms, scene.semantics.space))


def cut_out(scene: Scene, members: Tensor, camera: Camera, matte: Tensor, render: Render) -> Tensor:
    """What some Gaussians add to a view, straight colour and alpha.

    All others are drawn black, so they cover and add nothing: no colour of a neighbour is at the edges.

    Args:
        members: (N,) bool. matte: (H, W), theirs in this view.

    Returns:
        (H, W, 4) in [0, 1]; colour is 0 where the matte is.
    """
    sh = torch.where(~members.to(scene.gaussians.sh.device)[:, None, None], 0.0, scene.gaussians.sh)
    sh[~members, 0] = -1 / SH_C0  # black from everywhere: colour is 0.5 + SH_C0 sh_0, clamped at 0
    black = replace(scene, gaussians=replace(scene.gaussians, sh=sh))
    rgb = render(black, camera, weight_maps=False).rgb
    colour = torch.where((matte >= _LEAST)[..., None], rgb / matte.clamp_min(_LEAST)[..., None], 0.0)
    return torch.cat((colour, matte[..., None]), -1).clamp(0, 1)


def surface(scene: Scene, members: Tensor, cameras: Sequence[Camera], render: Render) -> Surface | None:
    """The surface of some Gaussians alone, fused from their depths in several views.

    A voxel is as large as the discs of the Gaussians are: finer would show their grid.

    Args:
        members: (N,) bool.

    Returns:
        None where no view shows half of a pixel of them.

    Raises:
        MissingPackageError: scikit-image is not installed.
    """
    finite = torch.isfinite(scene.gaussians.means).all(1).to(members.device)
    part = scene.rows(members & finite)
    if not len(part.gaussians):
        return None
    means = part.gaussians.means.detach().cpu().double().numpy()
    low, high = np.quantile(means, ANSWERING.box_quantiles, axis=0)
    views = [_coloured_view(render(part, camera, weight_maps=False), camera) for camera in cameras]
    return fuse(views, low, high, 2 * float(np.median(disc_radii(part.gaussians))))


def _coloured_view(frame: Frame, camera: Camera) -> ColouredView:
    """Depths where at least half of a pixel is covered."""
    alphas = frame.alphas.cpu()
    depths = torch.where(alphas >= ANSWERING.covered_alpha, frame.depths.cpu(), 0.0)
    straight = frame.rgb.cpu() / alphas.clamp_min(_LEAST)[..., None]
    colours = (straight.clamp(0, 1) * 255).round().byte()
    matrices = camera.viewmat.cpu().double().numpy(), camera.K.cpu().double().numpy()
    return ColouredView(depths.double().numpy(), *matrices, colours.numpy())
