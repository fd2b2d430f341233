"""Photos more for a finished scene, each for the price of itself and four others, however many there are.

The photos that show most of the same as the new one lie in the scene's file, as they were reconstructed, and
their layers say where what they show is: that places the new camera. With these poses they and the new photo
make a small scene in the same world, whose new layer then joins the others (`surface.added`). What the scene
has stays as it is, bit by bit.
"""

import math
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.base.records import FoundFocal, FoundLens
from langflash_core.cameras.keypoints import KeyPoints, match_sources
from langflash_core.cameras.placing import Sightings, adjust_camera, place_camera
from langflash_core.errors import InputError
from langflash_core.geometry.cameras import fov_degrees
from langflash_core.geometry.pinhole import from_pixels
from langflash_core.images.decode import PhotoFacts, read_photo
from langflash_core.images.lens import exif_fov
from langflash_core.images.pictures import centre_box, photo_names
from langflash_core.images.settings import LENS_PRIOR, PHOTO_LIMITS
from langflash_core.images.straight import straighten_views
from langflash_core.images.triage import fov_notes
from langflash_core.images.views import load_views
from langflash_core.network.presets import PRESETS
from langflash_core.rig.settings import ADDING, MATCHING
from langflash_core.scene.settings import JOINING
from langflash_core.surface.added import Shared, add_layers
from langflash_core.surface.foreseen import CELL, draw_points
from langflash_core.types import Lenses, Scene, Views

Make = Callable[[Sequence[Path], Sequence[float], Float[Tensor, "V 4 4"]], Scene]


def scene_with(
    scene: Scene, photos: Sequence[Path], make: Make, check: Callable[[], None] = lambda: None
) -> Scene:
    """The scene with layers of photos more.

    Args:
        make: photos, the fields of view of their longer sides and their poses to a scene in that world, with
            views of the scene's size.
        check: called between photos; what it raises ends the work.

    Raises:
        InputError: the scene has no layers or keeps no photos, a photo shows too little of what the scene
            does, or there would be too many. ImageError: a photo cannot be used.
    """
    _check(scene, len(photos))
    views = [_view(scene, path, check) for path in photos]
    known = range(scene.num_views)
    pairs = [(old, len(known) + new) for new in range(len(views)) for old in known]
    matches = match_sources((*scene.photos, *(view.sources[0] for view in views)), check, pairs=pairs)
    placed = [_place(scene, matches, number, view) for number, view in enumerate(views)]
    beside = sorted({other for one in placed for other in one.beside})
    sources = [*(scene.photos[view] for view in beside), *(view.sources[0] for view in views)]
    Ks = [*scene.Ks[beside], *(view.Ks[0] for view in views)]
    sizes = [*(scene.view_size for _ in beside), *(view.size for view in views)]
    poses = torch.stack([*scene.viewmats[beside].double(), *(one.viewmat for one in placed)])
    with tempfile.TemporaryDirectory(prefix="langflash-") as folder:
        files = [Path(folder) / f"photo~{place:03}~.jpg" for place in range(len(sources))]
        for path, source in zip(files, sources, strict=True):
            path.write_bytes(source)
        fields = [max(fov_degrees(K, *size)) for K, size in zip(Ks, sizes, strict=True)]
        other = make(files, fields, poses)
    names = [path.name for path in files]
    other = _without_lens_notes(other, zip(names, Ks, sizes, strict=True))
    ours = [scene.record.photos[view] for view in beside]
    other = _rename(other, names, [*ours, *photo_names(list(photos))], len(beside))
    return add_layers(scene, other, Shared(tuple(beside), tuple(range(len(beside)))))


def _view(scene: Scene, path: Path, check: Callable[[], None]) -> Views:
    """A new photo as the scene's were taken: with their lens, straightened as they were."""
    photo = read_photo(path).facts
    lens, (width, height) = _lens(scene, photo), scene.view_size
    field = _field_like_the_first(scene, photo) if lens is None else lens.fov
    patch = PRESETS["mini"].patch  # sides of which photos keep most pixels
    views = load_views([path], fov=field, area=width * height, multiple=patch, check=check)
    if lens is None or not lens.bend:
        return views
    views = replace(views, lenses=Lenses((0,), (field,), (0.0,), (False,)))
    return straighten_views(views, [FoundFocal(1.0, 0.0, lens.photos, lens.bend)])


def _field_like_the_first(scene: Scene, photo: PhotoFacts) -> float:
    """Degrees of the longer side of a photo that the lens of the scene's first one took, cropped as that."""
    size = scene.view_size
    if (size[0] > size[1]) != (photo.width > photo.height):
        size = (size[1], size[0])
    left, _, right, _ = centre_box(photo.width, photo.height, size)
    focal = float(scene.Ks[0, 0, 0]) * (right - left) / size[0]
    return math.degrees(2 * math.atan(max(photo.width, photo.height) / (2 * focal)))


def _lens(scene: Scene, photo: PhotoFacts) -> FoundLens | None:
    """What was found of photos that say the same of their lens, or what the photo says; None where it says
    nothing."""
    said = exif_fov(photo)
    for known in scene.record.lens.get("found", ()):
        own = LENS_PRIOR.assumed_fov if said is None else said
        if known["recorded"] == (said is not None) and abs(known["said"] - own) < ADDING.same_lens:
            return FoundLens(**known)
    return None if said is None else FoundLens(said, 0.0, 1, said, True)


def _without_lens_notes(scene: Scene, photos: Iterable[tuple[str, Tensor, tuple[int, int]]]) -> Scene:
    """Nobody is told to use another lens where the scene knows this one; photos: name, K and size."""
    notes = {line for name, K, size in photos for line in fov_notes(name, K, *size)}
    return scene.with_record(warnings=tuple(line for line in scene.record.warnings if line not in notes))


def _rename(scene: Scene, held: Sequence[str], names: Sequence[str], ours: int) -> Scene:
    """With people's names of photos; of what is said that which speaks of others than the first `ours`."""
    told = [line for line in scene.record.warnings if any(name in line for name in held[ours:])]
    for name, own in zip(held, names, strict=True):  # of one length, so that none is part of another
        told = [line.replace(name, own) for line in told]
    return scene.with_record(photos=tuple(names), warnings=tuple(told))


def _check(scene: Scene, count: int) -> None:
    if not scene.layered or not scene.photos:
        raise InputError(
            "this scene keeps no layer and picture of each photo, as those of two photos and the preset mini "
            "do; reconstruct it again with all photos"
        )
    whole, most = scene.num_views + count, PHOTO_LIMITS.max_photos
    if whole > most:
        raise InputError(f"{whole} photos are too many; a scene has at most {most} of them")
    atoms = scene.semantics.num_atoms
    if atoms + PRESETS["mini"].splitting.max_parts > JOINING.most_atoms:
        raise InputError(
            f"the scene has {atoms} groups, too many for those of another photo; reconstruct it again with "
            "all photos"
        )


@dataclass(frozen=True)
class _Placed:
    """A new photo's pose (4, 4) in the scene's world, and the scene's photos that show most of the same."""

    viewmat: Float[Tensor, "4 4"]
    beside: list[int]


def _place(scene: Scene, matches: KeyPoints, number: int, view: Views) -> _Placed:
    """By the places that its key points have in the layers of the photos that have them, too; then adjusted
    with these places free."""
    row = scene.num_views + number
    counts = {other: len(matches.pairs[other, row]) for other in range(scene.num_views)}
    beside = sorted(counts, key=lambda other: -counts[other])[: ADDING.beside]
    ours, own = np.concatenate([matches.pairs[other, row] for other in beside]).T
    views = np.repeat(beside, [counts[other] for other in beside])
    seen = np.array([matches.positions[other][place] for other, place in zip(views, ours, strict=True)])
    points = np.concatenate([_seen_at(scene, other, seen[views == other]) for other in beside])
    K, pixels = _working_K(view.Ks[0], view.size), matches.positions[row][own]
    solid = np.isfinite(points).all(1)
    placed = place_camera(points[solid], pixels[solid], K, ADDING.misses)
    if placed is None or placed.agree.sum() < MATCHING.fewest:
        raise InputError(
            f"{view.names[0]} could not be placed beside the scene's photos; take one that shows half of "
            "what one of them shows"
        )
    depths = points @ placed.viewmat[2, :3] + placed.viewmat[2, 3]
    solid &= depths > 0
    rows, of = np.unique(own[solid], return_inverse=True)
    sightings = Sightings(
        pixels=matches.positions[row][rows],
        depths=np.array([np.median(depths[solid][of == number]) for number in range(len(rows))]),
        of=of,
        seen=seen[solid],
        viewmats=scene.viewmats.double().numpy()[views[solid]],
        Ks=np.stack([_working_K(K, scene.view_size) for K in scene.Ks])[views[solid]],
    )
    return _Placed(torch.from_numpy(adjust_camera(placed.viewmat, K, sightings)), beside)


def _working_K(K: Float[Tensor, "3 3"], size: tuple[int, int]) -> Float[np.ndarray, "3 3"]:
    """Of the photo at the size at which it is matched."""
    working = K.double().numpy().copy()
    working[:2] *= MATCHING.working_side / max(size)
    return working


def _seen_at(scene: Scene, view: int, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Points of the world that a photo's own layer shows at key points (`KeyPoints.positions`); no numbers
    where it shows none. The layer says how far away they are, the pixels in which direction."""
    assert scene.view_ids is not None, "scenes of layers know which photo made what"
    gaussians, camera = scene.gaussians, scene.camera(view)
    means = gaussians.means[(scene.view_ids == view) & (gaussians.opacities > ADDING.solid)].T
    viewmat, pixels = camera.viewmat.double().numpy(), pixels * (max(scene.view_size) / MATCHING.working_side)
    points, nearest = draw_points(means, means, camera)
    places = torch.from_numpy(pixels / CELL).long()
    x, y = (places[:, axis].clamp(0, side - 1) for axis, side in enumerate(reversed(nearest.shape)))
    there, some = torch.isfinite(nearest[y, x]).numpy(), points[:, y, x].double().numpy()
    depths = np.where(there, viewmat[2, :3] @ some + viewmat[2, 3], np.nan)
    rays = from_pixels(pixels, camera.K.double().numpy())
    seen = np.column_stack((rays * depths[:, None], depths))
    return (seen - viewmat[:3, 3]) @ viewmat[:3, :3]
