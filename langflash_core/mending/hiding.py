"""A part of a scene hidden for good: blurred, as pixels, or taken out, in its Gaussians and in its photos.

1. Where photos show the part, and a margin around it, is its mask. All Gaussians that lie there, no farther
   than what the view shows, belong to the rim and are hidden with the part: colours of a thing run over its
   edge. So do all that this photo made there, also behind the part, where nobody saw anything.
2. They become blocks (`coarse.py`), or go, and what was behind them is filled in (`filling.py`).
3. Photos get what the scene shows now, in all of their masks (`photos.py`), and where they show what was left
   out of the scene, since other photos do not show it.
4. What nobody needs any more goes: atoms that nothing carries, names that people gave to what was hidden, and
   what a newer version put beside the scene.

Sizes: N Gaussians, V views.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.mending.settings import HIDING, RECIPE_DEFAULTS
from langflash_core.rig.projected import project_points
from langflash_core.scene.instances import instances
from langflash_core.scene.joining import append_part
from langflash_core.splat.frustum import may_touch
from langflash_core.surface.prune import sparser
from langflash_core.types import Camera, Scene

from .coarse import coarsen
from .filling import fill
from .looks import Progress, Render, mattes
from .photos import dilate_mask, not_in_scene, painted_over, reaches

How = Literal["blur", "pixels", "remove"]


@dataclass(frozen=True)
class Hiding:
    """How a part is hidden. blocks: along its longest side. margin: around it in photos, of their longer
    side. photos: painted over; else left out. filled: of what is removed, what was behind it.

    Raises:
        InputError: out of range.
    """

    how: How = "blur"
    blocks: float = HIDING.blocks
    margin: float = RECIPE_DEFAULTS.margin
    photos: bool = True
    filled: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.blocks <= HIDING.most_blocks:
            raise InputError(f"{self.blocks:g} blocks do not hide it; choose 1 to {HIDING.most_blocks:g}")
        if not 0 <= self.margin <= RECIPE_DEFAULTS.most_margin:
            raise InputError(
                f"a margin of {self.margin:g} is out of range; choose 0 to {RECIPE_DEFAULTS.most_margin:g}"
            )


@dataclass(frozen=True)
class Hidden:
    """What was done. members: Gaussians of the part; rim: of its margin; made: in their place. side: of a
    block, scene units, 0 where none are. photos: share of the pixels painted over, by view, of those that
    were. names: that people gave and that went. unknown: keys of what is not known and went."""

    how: How
    members: int
    rim: int
    made: int
    side: float
    photos: Mapping[int, float]
    photos_left_out: bool
    names: tuple[str, ...]
    unknown: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {
            **vars(self),
            "photos": {str(view + 1): round(share, 4) for view, share in self.photos.items()},
        }


def hide(
    scene: Scene,
    members: Tensor,
    render: Render,
    hiding: Hiding | None = None,
    progress: Progress | None = None,
) -> tuple[Scene, Hidden]:
    """The scene with a part hidden so that it cannot be brought back, and what was done.

    Args:
        members: (N,) bool, the part. render: draws scenes. hiding: None: the usual.

    Raises:
        InputError: nothing is to be hidden. SceneFileError: a photo cannot be read.
    """
    hiding, told = hiding or Hiding(), progress or (lambda stage, share: None)
    members = members.cpu()
    if not bool(members.any()):
        raise InputError("nothing was chosen to be hidden; name or select something that is there")
    told("looking", 0.1)
    margins, least = _reach_margins(scene, members, render)
    masks, rows = [each <= hiding.margin for each in margins], least <= hiding.margin
    side = 0.0 if hiding.how == "remove" else _block_side(scene, members, hiding.blocks)
    told("hiding", 0.3)
    kept, names = _remove_names(scene, rows)
    kept = kept.rows(~rows)
    if hiding.how != "remove":
        made = coarsen(scene.rows(rows), side, squares=hiding.how == "pixels")
    elif hiding.filled:
        made = fill(scene, rows, render)
    else:
        made = kept.rows(torch.zeros(0, dtype=torch.int64))
    done = append_part(kept, made).with_record(others={})
    told("photos", 0.6)
    if hiding.photos:
        masks = [mask | _transients(scene, view, hiding, render) for view, mask in enumerate(masks)]
    done, shares = _with_photos(done, masks, hiding, render)
    report = Hidden(
        hiding.how, int(members.sum()), int(rows.sum() - members.sum()), len(made.gaussians), side, shares,
        bool(scene.photos) and not hiding.photos, names, tuple(scene.record.others),
    )  # fmt: skip
    return sparser(done), report


def preview(scene: Scene, members: Tensor, render: Render, margin: float = RECIPE_DEFAULTS.margin) -> Tensor:
    """(N,) bool: all Gaussians that `hide` would change."""
    return least_margins(scene, members, render) <= margin


def least_margins(scene: Scene, members: Tensor, render: Render) -> Tensor:
    """(N,) the margin from which on `hide` changes each Gaussian; infinite where none does, 0 of the part."""
    return _reach_margins(scene, members.cpu(), render)[1]


def _reach_margins(scene: Scene, members: Tensor, render: Render) -> tuple[list[np.ndarray], Tensor]:
    """The margins from which on pixels (H, W) of all views, and Gaussians (N,), are hidden with the part."""
    cameras = [scene.camera(view) for view in range(scene.num_views)]
    means, margins = scene.gaussians.means.cpu(), []
    least = torch.where(members, 0.0, torch.inf)
    part = scene.gaussians.rows(members)
    for camera in cameras:
        if not may_touch(part, camera).any():
            margins.append(np.full((camera.height, camera.width), np.inf, np.float32))
            continue
        ((matte, depths),) = mattes(scene, members, [camera], render)
        margins.append(reaches((matte >= HIDING.matte).numpy()))
        inside, pixels, near = _lying_in(means, camera, depths)
        own = torch.zeros_like(near) if scene.view_ids is None else scene.view_ids.cpu() == len(margins) - 1
        told = torch.from_numpy(margins[-1]).flatten()[pixels]
        least = torch.where(inside & (near | own), torch.minimum(least, told), least)
    return margins, least


def _lying_in(means: Tensor, camera: Camera, depths: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(N,) each: whether places are in a view's picture, at which of its pixels (0 outside), and whether they
    are no farther than what it shows there, depths (H, W)."""
    there = project_points(means.T, camera.viewmat.cpu(), camera.K.cpu(), (depths.shape[0], depths.shape[1]))
    shown = there.looked_up(depths.flatten())
    return there.inside, there.pixels, (shown * HIDING.beside >= there.z) | (shown <= 0)


def _block_side(scene: Scene, members: Tensor, blocks: float) -> float:
    """Scene units: the longest side of the largest connected thing of the part, over so many blocks."""
    numbers = instances(scene.gaussians, members.numpy())
    largest = torch.from_numpy(numbers == 1) if (numbers == 1).any() else members
    means = scene.gaussians.means[largest].double()
    low, high = means.quantile(0.02, dim=0), means.quantile(0.98, dim=0)
    longest = float((high - low).max())
    return max(longest / blocks, 2 * float(scene.gaussians.scales[largest].max()), 1e-6)


def _remove_names(scene: Scene, rows: Tensor) -> tuple[Scene, tuple[str, ...]]:
    """The scene without what people called what is hidden: names and denials of atoms that mostly lie in it,
    notes pinned to it, names of the inventory's things."""
    record, semantics = scene.record, scene.semantics
    notes = list(record.tour.get("notes", ()))
    pinned = _is_pinned(notes, scene, rows)
    told = {*record.atom_names, *record.atom_denials}
    shares = semantics.weight_values * scene.gaussians.opacities[:, None]
    sums = torch.zeros(2, semantics.num_atoms + 1)
    for place, some in enumerate((rows, torch.ones_like(rows))):
        sums[place].index_add_(0, semantics.weight_ids[some].flatten(), shares[some].flatten().float())
    gone = {k for k in told if float(sums[0, k]) >= HIDING.own * float(sums[1, k])}
    names = (
        *(record.atom_names[k] for k in sorted(gone) if k in record.atom_names),
        *record.thing_names.values(),
        *(str(note.get("text", "")) for note, of_it in zip(notes, pinned, strict=True) if of_it),
    )
    tour = dict(record.tour)
    if any(pinned):
        tour["notes"] = [note for note, of_it in zip(notes, pinned, strict=True) if not of_it]
    cleared = replace(
        record,
        tour=tour,
        thing_names={},  # with other things in the scene, the inventory counts them anew
        atom_names={k: name for k, name in record.atom_names.items() if k not in gone},
        atom_denials={k: said for k, said in record.atom_denials.items() if k not in gone},
    )
    return replace(scene, record=cleared), names


def _is_pinned(notes: list[dict], scene: Scene, rows: Tensor) -> list[bool]:
    """Of notes, whether what is hidden is nearer to one of their ends than all that stays."""
    means, found = scene.gaussians.means.double(), []
    for note in notes:
        ends = torch.tensor([end for end in (note.get("at"), note.get("to")) if end], dtype=torch.float64)
        far = torch.cdist(ends.reshape(-1, 3), means)  # (e, N)
        hidden, kept = far.masked_fill(~rows, torch.inf), far.masked_fill(rows, torch.inf)
        found.append(bool((hidden.amin(1) < kept.amin(1)).any()))
    return found


def _transients(scene: Scene, view: int, hiding: Hiding, render: Render) -> np.ndarray:
    """(H, W) bool: what a photo shows that was left out of the scene, where anything of that photo was."""
    shares = scene.record.left_out.get("shares", ())
    if not scene.photos or view >= len(shares) or not shares[view]:
        return np.zeros(scene.view_size[::-1], bool)
    return dilate_mask(not_in_scene(scene, view, render), hiding.margin)


def _with_photos(
    scene: Scene, masks: list[np.ndarray], hiding: Hiding, render: Render
) -> tuple[Scene, dict[int, float]]:
    """The scene with photos painted over, or without any; and the share of each that was."""
    if not scene.photos or not hiding.photos:
        return replace(scene, photos=()).with_record(photos=()) if scene.photos else scene, {}
    shares = {view: float(mask.mean()) for view, mask in enumerate(masks) if mask.any()}
    photos = (
        painted_over(scene, view, masks[view], render) if view in shares else photo
        for view, photo in enumerate(scene.photos)
    )
    return replace(scene, photos=tuple(photos)), shares
