"""What `lab eval sides` walks around: photos, and true looks from places that no photo was taken at.

A *look* is a picture and its true depth from a known place. World: the first photo's camera, metres.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.evaluation.bench import as_array, as_seen, picture_of, relative
from langflash_core.lab.evaluation.posed import Triple
from langflash_core.lab.evaluation.side_measures import angle_between, seen_by, turned_about
from langflash_core.lab.photos import LabelledPhoto, PhotoFolder
from langflash_core.lab.rooms import Pack, RoomRenderer, StagedRoom
from langflash_core.lab.rooms.cameras import stands_free
from langflash_core.lab.training.commands import set_rooms

ANGLES = (10, 20, 30, 45)
"""Degrees around what the photos look at, to the left and to the right."""
TILT = 15
"""Degrees over and under it."""
MIN_SEEN = 0.1
"""Share of a look that the photos must see, or it says too little."""
NEAR_ANGLE, TRIED = 2.5, 8
"""Degrees by which a photo of a folder may miss the angle that it stands for, and how many are looked at
to find the one of which the pair sees the most."""
ACROSS_UP = {"right": (0, 1), "left": (0, -1), "up": (1, -1), "down": (1, 1)}
"""Axis (0: up, 1: the camera's right) and sense of the turn that carries a camera that way."""


@dataclass(frozen=True)
class Look:
    """A true picture: rgb (H, W, 3) in [0, 1]; `group` is what it is counted under."""

    name: str
    group: str
    view: DepthView
    rgb: Tensor

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)."""
        return self.rgb.shape[1], self.rgb.shape[0]


@dataclass(frozen=True)
class Subject:
    """The looks of the photos, in their order, and those from elsewhere."""

    photos: tuple[Look, ...]
    others: tuple[Look, ...]


@dataclass(frozen=True)
class Case:
    """Photos to make a scene of, and the truth at the size (width, height) that the scene has."""

    name: str
    photos: tuple[LabelledPhoto, ...]
    truth: Callable[[tuple[int, int]], Subject]


def centre_depth(depths: Float[np.ndarray, "H W"]) -> float:
    """Median of what is known in the middle half of a picture, of either side: what it looks at."""
    height, width = depths.shape
    middle = depths[height // 4 : height - height // 4, width // 4 : width - width // 4]
    known = middle[middle > 0] if (middle > 0).any() else depths[depths > 0]
    return float(np.median(known)) if len(known) else 1.0


def pivot_of(view: DepthView) -> Float[np.ndarray, " 3"]:
    """The world point in the middle of a picture, at `centre_depth`."""
    height, width = view.depths.shape
    ray = np.linalg.inv(view.K) @ np.array([width / 2, height / 2, 1.0])
    return view.viewmat[:3, :3].T @ (ray * centre_depth(view.depths) - view.viewmat[:3, 3])


def carried(view: DepthView, way: str, degrees: float, up: Float[np.ndarray, " 3"]) -> np.ndarray:
    """The camera of a view, carried around what it looks at: "left", "right", "up" or "down"."""
    number, sense = ACROSS_UP[way]
    axis = (up, view.viewmat[0, :3])[number]
    return turned_about(view.viewmat, pivot_of(view), axis, sense * degrees)


def room_cases(
    pack: Pack, renderer: RoomRenderer, *, kind: str = "held_out", count: int = 100
) -> Iterator[Case]:
    """Rooms of a set of `langflash lab train cache`, made again from their seeds: the same photos.

    Args:
        kind: "held_out" or "validation".
    """
    for staged in set_rooms(pack, renderer, kind, count):
        yield staged_case(staged, renderer)


def staged_case(staged: StagedRoom, renderer: RoomRenderer) -> Case:
    """A room that `renderer` was last given; its looks are drawn while it is."""
    views = staged.views
    K = torch.from_numpy(views.Ks[0])
    photos = tuple(LabelledPhoto(f"{views.seed}_{v}", views.images[v], K=K) for v in (0, 1))
    own = [_stored_look(staged, v) for v in range(len(views.images))]

    def truth(size: tuple[int, int]) -> Subject:
        if size != own[0].size:
            raise ValueError(f"size: expected that of the rooms {own[0].size}, received {size}")
        ways = [(way, angle) for angle in ANGLES for way in ("left", "right")]
        ways += [("up", TILT), ("down", TILT)]
        looks = [
            _look(staged, renderer, own[0].view, way, angle)
            for way, angle in ways
            if _free(staged, _carried(staged, own[0].view, way, angle))
        ]
        return Subject(tuple(own[:2]), tuple(_worth(looks, own[:2]) + _worth(own[2:], own[:2])))

    return Case(str(views.seed), photos, truth)


def _stored_look(staged: StagedRoom, view: int) -> Look:
    views = staged.views
    name = ("first photo", "second photo", "between")[view]
    here = DepthView(views.depths[view].astype(float), views.viewmats[view], views.Ks[view])
    group = "0" if view < 2 else "between"
    return Look(name, group, here, torch.from_numpy(views.images[view].astype(np.float32) / 255))


def _carried(staged: StagedRoom, view: DepthView, way: str, degrees: float) -> np.ndarray:
    return carried(view, way, degrees, staged.home[:3, 1])


def _look(staged: StagedRoom, renderer: RoomRenderer, view: DepthView, way: str, degrees: float) -> Look:
    moved = _carried(staged, view, way, degrees)
    rgb, depths = staged.look(renderer, moved, view.K, view.depths.shape)  # type: ignore[arg-type]
    group = str(degrees) if way in ("left", "right") else f"{way} {degrees}"
    picture = torch.from_numpy(rgb.astype(np.float32) / 255)
    return Look(f"{degrees} {way}", group, DepthView(depths.astype(float), moved, view.K), picture)


def _free(staged: StagedRoom, viewmat: np.ndarray) -> bool:
    """Whether a camera fits there: not in a wall, not in a wardrobe."""
    in_room = viewmat @ staged.home
    return stands_free(staged.room, -in_room[:3, :3].T @ in_room[:3, 3])


def _worth(looks: Sequence[Look], photos: Sequence[Look]) -> list[Look]:
    """Looks of which the photos see `MIN_SEEN`."""
    views = [photo.view for photo in photos]
    return [look for look in looks if seen_by(look.view, views).mean() >= MIN_SEEN]


def posed_cases(folder: PhotoFolder, triples: Sequence[Triple]) -> Iterator[Case]:
    """Pairs of a posed folder: the photo from between, and for each of `ANGLES` a photo of the folder that
    was taken from about there, counted from the nearer photo of the pair.

    Raises:
        InputError, when its truth is asked for: a photo has no depth, or no pose.
    """
    for triple in triples:
        photos = tuple(folder.photo(id) for id in (triple.first, triple.second))

        def truth(size: tuple[int, int], triple: Triple = triple, photos: tuple = photos) -> Subject:
            own = tuple(photo_look(photo, photos[0], size, "0") for photo in photos)
            if not (own[0].view.depths > 0).any():
                raise InputError(
                    f"photo {triple.first} has no depth in metres, which is needed; add it, or --depth-unit"
                )
            between = photo_look(folder.photo(triple.between), photos[0], size, "between")
            aside = _looks_aside(folder, triple, photos[0], own, size)
            return Subject(own, tuple(_worth([between, *aside], own)))

        yield Case(triple.name, photos, truth)


def photo_look(photo: LabelledPhoto, first: LabelledPhoto, size: tuple[int, int], group: str) -> Look:
    """A photo of a posed folder at a size (width, height); world: the first photo's camera."""
    seen = as_seen(photo, size)
    view = DepthView(as_array(seen.depths), as_array(relative(first, photo)), as_array(seen.K))
    return Look(photo.id, group, view, picture_of(seen))


def _looks_aside(
    folder: PhotoFolder, triple: Triple, first: LabelledPhoto, own: Sequence[Look], size: tuple[int, int]
) -> list[Look]:
    assert first.pose is not None and folder.poses is not None
    pivot = pivot_of(own[0].view)
    angles = {}
    for id, pose in folder.poses.items():
        viewmat = as_array(torch.linalg.inv(pose.double()) @ first.pose.double())
        if id in folder.ids and id not in (triple.first, triple.between, triple.second):
            angles[id] = angle_between([look.view.viewmat for look in own], viewmat, pivot)
    looks = []
    for angle in ANGLES:
        nearest = sorted(angles, key=lambda id: (abs(angles[id] - angle), id))[:TRIED]
        fitting = [id for id in nearest if abs(angles[id] - angle) <= NEAR_ANGLE]
        found = [photo_look(folder.photo(id), first, size, str(angle)) for id in fitting]
        views = [look.view for look in own]
        looks += sorted(found, key=lambda look: -seen_by(look.view, views).mean())[:1]
    return looks
