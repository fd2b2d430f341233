"""What `langflash lab eval walk` goes along: a walk in 2, 4, 8 ... photos, and frames kept from all of them.

A walk is a row of frames, number 0 to `last`. Of `most`, the largest number of photos, there are two frames
a photo: `last` = 2 (most - 1). Two rules say which frames are photos:

"same" (the default): n photos are spread evenly over the whole walk, frame round(k last / (n - 1)). Kept are
    frames half-way between neighbours of the most photos, with odd numbers; a photo that would fall on one
    of those takes the frame before it. So all numbers of photos show the same place, are judged at the same
    frames, and each kept frame lies between two photos, ever nearer ones.
"apart": photos are always as far apart, frames 0, 2, 4 ...; n photos are the first n. Kept are the frames
    between the photos of the least, all of them, and of those that each further number adds up to a half of
    `kept`. So what two photos know of a kept frame stays the same, and only what the others bring changes.

Own of a kept frame are the two photos around it, of those that the scene was made of.

World: any, metres; H W pixels.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.lab.evaluation.walk_passers import Screen, screen_in, with_somebody
from langflash_core.lab.evaluation.walk_rooms import Way, found_way
from langflash_core.lab.photos import LabelledPhoto, PhotoFolder
from langflash_core.lab.rooms import Pack, RoomRenderer, StagedRoom
from langflash_core.lab.rooms.layout import Room
from langflash_core.lab.rooms.render import Picture
from langflash_core.lab.rooms.sensor import expose
from langflash_core.lab.training.commands import set_rooms
from langflash_core.surface.settings import LAYERS

PHOTOS = (2, 4, 8, 16, 32)
KEPT = 8


@dataclass(frozen=True)
class Plan:
    """Which frames are photos, by how many they are, and which are kept, in order."""

    last: int
    chosen: dict[int, tuple[int, ...]]
    kept: tuple[int, ...]

    def between(self, photos: int) -> tuple[int, ...]:
        """Kept frames that lie between photos of that number."""
        chosen = self.chosen[photos]
        return tuple(frame for frame in self.kept if chosen[0] < frame < chosen[-1])

    def own(self, photos: int, frame: int) -> tuple[int, int]:
        """The two photos around a kept frame."""
        chosen = self.chosen[photos]
        return max(f for f in chosen if f < frame), min(f for f in chosen if f > frame)


def planned(photos: Sequence[int], kept: int = KEPT, rule: str = "same") -> Plan:
    """The frames of a walk.

    Args:
        photos: numbers of photos. kept: about so many frames are kept.

    Raises:
        InputError: a number is below two, or too near another for a frame between.
    """
    numbers = sorted(set(photos))
    if not numbers or numbers[0] < 2:
        raise InputError("a walk needs two photos or more; choose others with --photos")
    if numbers[-1] == 2 and rule == "same":
        return Plan(2, {2: (0, 2)}, (1,))
    last = 2 * (numbers[-1] - 1)
    if rule == "apart":
        chosen = {n: tuple(range(0, 2 * n, 2)) for n in numbers}
        return Plan(last, chosen, _growing(numbers, kept))
    frames = _evenly([2 * k + 1 for k in range(numbers[-1] - 1)], kept)
    chosen = {}
    for n in numbers:
        places = [round(k * last / (n - 1)) for k in range(n)]
        chosen[n] = tuple(place - 1 if place in frames else place for place in places)
    return Plan(last, chosen, frames)


def _growing(numbers: Sequence[int], kept: int) -> tuple[int, ...]:
    frames: list[int] = []
    before = 1
    for n in numbers:
        added = [2 * k + 1 for k in range(before - 1, n - 1)]
        frames += added if n == numbers[0] else _evenly(added, max(1, kept // 2))
        before = n
    return tuple(frames)


def _evenly(values: Sequence[int], count: int) -> tuple[int, ...]:
    count = min(count, len(values))
    return tuple(values[(2 * k + 1) * len(values) // (2 * count)] for k in range(count))


@dataclass(frozen=True)
class Walk:
    """Frames by number. photo: as the camera took it; kept: the same place as a picture should show it;
    camera: world to camera (4, 4)."""

    name: str
    plan: Plan
    photo: Callable[[int], LabelledPhoto]
    kept: Callable[[int], LabelledPhoto]
    camera: Callable[[int], Float[np.ndarray, "4 4"]]


def posed_walks(folder: PhotoFolder, plan: Plan, count: int, step: int = 1) -> Iterator[Walk]:
    """Walks of a posed folder, their first frames spread evenly over it.

    Args:
        step: photos of the folder from frame to frame.

    Raises:
        InputError: the folder is too short, or a photo has no pose.
    """
    ids = [id for id in folder.ids if folder.poses and id in folder.poses]
    starts = len(ids) - plan.last * step
    if starts < 1:
        raise InputError(
            f"a walk needs {plan.last * step + 1} photos with poses, but {folder.root.name} has {len(ids)}; "
            "choose fewer with --photos"
        )
    count = min(count, starts)
    for k in range(count):
        first = 0 if count == 1 else round(k * (starts - 1) / (count - 1))
        names = ids[first::step][: plan.last + 1]

        def photo(frame: int, names: list[str] = names) -> LabelledPhoto:
            return folder.photo(names[frame])

        def camera(frame: int, names: list[str] = names) -> np.ndarray:
            assert folder.poses is not None
            return np.linalg.inv(folder.poses[names[frame]].double().numpy())

        yield Walk(f"{names[0]}-{names[-1]}", plan, photo, photo, camera)


@dataclass(frozen=True)
class Camcorder:
    """What a camera does to the photos of a rendered walk.

    exposure: stops by which each photo's exposure may differ, either way, white balance by a sixth of it.
    times: the network's grid a photo is large.
    passers, screens: photos in which somebody stands, and in which a screen shows another picture; kept
    frames show nobody, and the screen as it is in the others.
    """

    exposure: float = 0.0
    times: int = LAYERS.most_enlarged
    passers: int = 0
    screens: int = 0


def room_walks(
    pack: Pack,
    renderer: RoomRenderer,
    plan: Plan,
    *,
    camcorder: Camcorder = Camcorder(),
    kind: str = "held_out",
    count: int = 20,
) -> Iterator[Walk]:
    """Walks through the rooms of `langflash lab eval sides`; those without a free way are passed over.

    Args:
        count: of walks.
    """
    found = 0
    for staged in set_rooms(pack, renderer, kind, 10**6):
        path = found_way(staged, renderer, staged.views.seed)
        if path is not None:
            found += 1
            yield _room_walk(staged, renderer, path, plan, camcorder)
        if found == count:
            return


def _room_walk(
    staged: StagedRoom, renderer: RoomRenderer, way: Way, plan: Plan, camcorder: Camcorder
) -> Walk:
    """Frames are drawn when they are asked for, which is while `renderer` has this room, and remembered."""
    known: dict[tuple[int, bool], LabelledPhoto] = {}
    stage = _Stage.of(staged, renderer, way, plan, camcorder)

    def frame(number: int, kept: bool) -> LabelledPhoto:
        if (number, kept) not in known:
            known[number, kept] = _taken(stage, number, camcorder, kept)
        return known[number, kept]

    return Walk(
        str(staged.views.seed),
        plan,
        lambda n: frame(n, False),
        lambda n: frame(n, True),
        lambda n: way(n / plan.last),
    )


@dataclass(frozen=True)
class _Stage:
    """A room with what happens in it. K: of the photos' size (height, width). crowded: by frame the room with
    somebody in it. screen: on a wall; changed: frames in which it shows another picture."""

    staged: StagedRoom
    renderer: RoomRenderer
    way: Way
    last: int
    K: np.ndarray
    size: tuple[int, int]
    crowded: dict[int, Room]
    screen: Screen | None
    changed: tuple[int, ...]

    @staticmethod
    def of(
        staged: StagedRoom, renderer: RoomRenderer, way: Way, plan: Plan, camcorder: Camcorder
    ) -> "_Stage":
        """`renderer` has the staged room, before and after."""
        height, width = (side * camcorder.times for side in staged.views.depths.shape[1:])
        K, seed = staged.views.Ks[0].astype(float), staged.views.seed
        K[:2] *= camcorder.times
        frames = plan.chosen[max(plan.chosen)]
        views = [way(frame / plan.last) for frame in frames]
        crowded = {
            frame: with_somebody(staged, renderer, way(frame / plan.last), K, seed + frame)
            for frame in _evenly(frames, camcorder.passers)
        }
        renderer.set_room(staged.room)
        screen = screen_in(staged, renderer, views, K, seed) if camcorder.screens else None
        there = {frame: room for frame, room in crowded.items() if room is not None}
        changed = _evenly(frames, camcorder.screens)
        return _Stage(staged, renderer, way, plan.last, K, (height, width), there, screen, changed)

    def draw(self, view: np.ndarray, frame: int, kept: bool) -> Picture:
        """The room as it is at a frame; kept: as it is without whoever passes."""
        crowded = None if kept else self.crowded.get(frame)
        if crowded is not None:
            self.renderer.set_room(crowded)
        picture = self.renderer.draw(view, self.K, self.size)
        if crowded is not None:
            self.renderer.set_room(self.staged.room)
        if self.screen is None:
            return picture
        number = self.staged.views.seed + (frame + 1 if frame in self.changed and not kept else 0)
        return self.screen.shown(picture, view, self.K, number, self.staged.grey)


def _taken(stage: _Stage, number: int, camcorder: Camcorder, kept: bool) -> LabelledPhoto:
    """One frame. Kept ones have the walk's own exposure, no noise and no JPEG."""
    seed = stage.staged.views.seed
    rng = np.random.default_rng([seed, 36, number])
    view = stage.way(number / stage.last)
    picture = stage.draw(view, number, kept)
    sensor = stage.staged.sensor
    if kept:
        sensor = replace(sensor, noise=0.0, quality=0)
    else:
        stops = rng.uniform(-1, 1, 4) * camcorder.exposure * np.array([1, 1 / 6, 0, 1 / 6])
        gains = 2.0 ** (stops[0] + stops[1:])
        balance = tuple(float(b * g) for b, g in zip(sensor.balance, gains, strict=True))
        sensor = replace(sensor, balance=balance)
    return LabelledPhoto(
        f"{seed}_{number:03d}",
        expose(picture.radiance, sensor, rng, stage.staged.grey),
        depths=picture.depth.astype(np.float32),
        metric=True,
        K=torch.from_numpy(stage.K).float(),
        pose=invert_rigid(torch.from_numpy(view).double()),
    )
