"""Two scenes as one: the second's Gaussians and atoms behind the first's, in the first's world."""

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Moved, Spot
from langflash_core.scene.mask import Mask
from langflash_core.scene.settings import JOINING
from langflash_core.types import NO_LANGUAGE, Gaussians, Scene, Semantics


def join_scenes(
    first: Scene,
    second: Scene,
    names: tuple[str, str] = ("this scene", "the other"),
    shown: Scene | None = None,
) -> Scene:
    """Both as one scene, the second beside the first.

    Rows and atoms of the first keep their numbers; those of the second follow, its names with them.
    Features stay as they are: f_i = sum_k w_ik d_k with the same w_ik and d_k. The second comes in
    the first's unit where both know theirs in metres. Views, photos and the rest of the record are the
    first's: cameras of the second would look at what is somewhere else now. They are antialiased where both
    are. Where one alone has levels, or confidences, all of the other is coarse, so that it is there in every
    picture, and sure. If the first has layers, what comes is in all of them.

    Args:
        second: without layers (`fused`), which the photos that it leaves behind would have to tell apart.
        names: of both, for people. shown: the first as edits changed it, beside which and in whose unit the
            second comes; None: as it is.

    Raises:
        InputError: their phrases mean different things, or together they have more than `JOINING.most_atoms`
            atoms.
        ValueError: the second has layers.
    """
    if second.layered:
        raise ValueError("second: expected a scene without layers, received one of layers; fuse it before")
    _check(first, second, names)
    placed = apply_changes(second.gaussians, (beside(first if shown is None else shown, second),))
    view_ids = None
    if first.view_ids is not None:
        view_ids = torch.cat((first.view_ids, first.view_ids.new_full((len(placed),), -1)))
    return _behind(first, replace(second, gaussians=placed), view_ids)


def append_layers(scene: Scene, part: Scene) -> Scene:
    """The scene with layers of more photos behind its own, and their views behind its views.

    The record keeps what it says of the scene's own photos, but for their light, which has to be of all.

    Args:
        part: in the scene's world and light.

    Raises:
        InputError: as `join_scenes`.
        ValueError: nobody knows which photo made what.
    """
    if scene.view_ids is None or part.view_ids is None:
        raise ValueError("view_ids: expected the photo that made each Gaussian, received none")
    _check(scene, part, ("this scene", "what is added"))
    views = {name: torch.cat((getattr(scene, name), getattr(part, name))) for name in ("viewmats", "Ks")}
    view_ids = torch.cat((scene.view_ids, part.view_ids + scene.num_views))
    record = replace(scene.record, light={})
    scene = replace(scene, **views, photos=(*scene.photos, *part.photos), record=record)
    return _behind(scene, part, view_ids)


def _behind(first: Scene, second: Scene, view_ids: Tensor | None) -> Scene:
    """The second's Gaussians and atoms behind the first's, where they are."""
    after, ours, theirs = first.semantics.num_atoms, first.record, second.record
    scene = replace(
        first,
        **_rows_of_both(first, second),
        semantics=_joined_semantics(first.semantics, second.semantics),
        view_ids=view_ids,
        record=replace(ours, atom_names={}, atom_denials={}, silent_atoms=(), lone_atoms=()),
    )
    return scene.with_record(
        atom_names={**ours.atom_names, **{k + after: name for k, name in theirs.atom_names.items()}},
        atom_denials={**ours.atom_denials, **{k + after: words for k, words in theirs.atom_denials.items()}},
        silent_atoms=(*ours.silent_atoms, *(k + after for k in theirs.silent_atoms)),
        antialiased=ours.antialiased and theirs.antialiased,
        lone_atoms=(*ours.lone_atoms, *(k + after for k in theirs.lone_atoms)),
    )


def append_part(scene: Scene, part: Scene) -> Scene:
    """The scene with a part of its own kind behind its Gaussians: of the same dictionary, in the same world.

    Raises:
        ValueError: the part has another dictionary.
    """
    if part.semantics.num_atoms != scene.semantics.num_atoms:
        raise ValueError(
            f"part: expected {scene.semantics.num_atoms} atoms, received {part.semantics.num_atoms}"
        )
    if not len(part.gaussians):
        return scene
    ours, theirs = scene.semantics, part.semantics
    most = max(ours.weight_ids.shape[1], theirs.weight_ids.shape[1])
    semantics = replace(
        ours,
        weight_ids=torch.cat([_pad_columns(each.weight_ids, most) for each in (ours, theirs)]),
        weight_values=torch.cat([_pad_columns(each.weight_values, most) for each in (ours, theirs)]),
    )
    view_ids = None
    if scene.view_ids is not None:
        unknown = scene.view_ids.new_full((len(part.gaussians),), -1)
        view_ids = torch.cat((scene.view_ids, unknown if part.view_ids is None else part.view_ids))
    return replace(scene, **_rows_of_both(scene, part), semantics=semantics, view_ids=view_ids)


def _rows_of_both(first: Scene, second: Scene) -> dict[str, Any]:
    """What is known of the rows of both; levels and confidences of the one that knows none are 0 and 1."""
    return {
        "gaussians": _stack_gaussians(first.gaussians, second.gaussians),
        "levels": _known_of_both(first, second, "levels", 0),
        "confidences": _known_of_both(first, second, "confidences", 1),
    }


def _known_of_both(first: Scene, second: Scene, name: str, unknown: int) -> Tensor | None:
    """(N,) of what one or the other knows, `unknown` for Gaussians of the one that does not."""
    ours, theirs = getattr(first, name), getattr(second, name)
    known = theirs if ours is None else ours
    if known is None:
        return None
    ours = known.new_full((len(first.gaussians),), unknown) if ours is None else ours
    theirs = known.new_full((len(second.gaussians),), unknown) if theirs is None else theirs
    return torch.cat((ours, theirs.to(ours)))


def beside(first: Scene, second: Scene) -> Moved:
    """Where the second comes to: at the first's right, on the same floor, as far away, in its unit."""
    ratio = 1.0
    if first.record.metric_scale and second.record.metric_scale:
        ratio = second.record.metric_scale / first.record.metric_scale
    (low, high), (their_low, their_high) = _box(first.gaussians), _box(second.gaussians)
    gap = JOINING.gap * float(high[0] - low[0])
    right = float(high[0]) + gap - ratio * float(their_low[0])
    down = float(high[1]) - ratio * float(their_high[1])
    ahead = float(low[2] + high[2] - ratio * (their_low[2] + their_high[2])) / 2
    offset: Spot = (right, down, ahead)
    return Moved(Mask.full(len(second.gaussians)), scale=ratio, offset=offset)


def _check(first: Scene, second: Scene, names: tuple[str, str]) -> None:
    ours, theirs = first.semantics, second.semantics
    if not len(second.gaussians):
        raise InputError(f"{names[1]} holds no Gaussian; choose another scene to merge")
    if NO_LANGUAGE in (ours.space, theirs.space):
        return
    if ours.space != theirs.space or ours.dictionary.shape[1] != theirs.dictionary.shape[1]:
        raise InputError(
            f"{names[1]} speaks {theirs.space} and {names[0]} speaks {ours.space}, so no phrase could be "
            "asked of both; merge scenes that the same preset made"
        )
    if ours.num_atoms + theirs.num_atoms > JOINING.most_atoms:
        raise InputError(
            f"{names[0]} and {names[1]} have {ours.num_atoms + theirs.num_atoms:,} groups together, at most "
            f"{JOINING.most_atoms} can be shown; merge groups in the dictionary first"
        )


def _box(gaussians: Gaussians) -> tuple[Tensor, Tensor]:
    """Lowest and highest (3,), between which nearly all Gaussians are."""
    means = gaussians.means.double()
    means = means[torch.isfinite(means).all(-1)]
    if not len(means):
        return torch.zeros(3), torch.zeros(3)
    ordered = means.sort(dim=0).values
    last = len(ordered) - 1
    return ordered[round(JOINING.edge * last)], ordered[round((1 - JOINING.edge) * last)]


def _stack_gaussians(first: Gaussians, second: Gaussians) -> Gaussians:
    """Both, with as many harmonics as the one that has more; the others' are 0."""
    bases = max(first.sh.shape[1], second.sh.shape[1])
    ours, theirs = (replace(some, sh=_pad_columns(some.sh, bases)) for some in (first, second))
    pairs = zip(vars(ours).values(), vars(theirs).values(), strict=True)
    return Gaussians(*(torch.cat((mine, yours.to(mine))) for mine, yours in pairs))


def _joined_semantics(first: Semantics, second: Semantics) -> Semantics:
    """One dictionary; the second's numbers begin behind the first's. Who carries less weights gets zeros."""
    spoken = second if first.space == NO_LANGUAGE else first
    channels, most = spoken.dictionary.shape[1], max(first.weight_ids.shape[1], second.weight_ids.shape[1])
    rows = [
        each.dictionary if each.num_atoms else each.dictionary.new_zeros(0, channels)
        for each in (first, second)
    ]
    shifted = second.weight_ids + first.num_atoms if second.num_atoms else second.weight_ids
    values = (_pad_columns(first.weight_values, most), _pad_columns(second.weight_values, most))
    return Semantics(
        weight_ids=torch.cat((_pad_columns(first.weight_ids, most), _pad_columns(shifted, most))),
        weight_values=torch.cat((values[0], values[1].to(values[0]))),
        dictionary=torch.cat((rows[0], rows[1].to(rows[0]))),
        space=spoken.space,
    )


def _pad_columns(values: Tensor, columns: int) -> Tensor:
    """(N, n, ...) with zeros up to so many columns."""
    more = values.new_zeros(len(values), columns - values.shape[1], *values.shape[2:])
    return torch.cat((values, more), 1)
