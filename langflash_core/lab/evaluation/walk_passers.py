"""What only some photos of a walk show: somebody who walks through, a screen whose picture changes.

Somebody is a piece of furniture of a person's size, on the floor between the camera and what it looks at, in
another place in each photo. A screen is a bright rectangle on a wall that most photos see, which shows one
picture, and another in those photos.

Worlds: the room's (y up), metres; H W pixels.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float

from langflash_core.lab.rooms import RoomRenderer, StagedRoom
from langflash_core.lab.rooms.layout import Instance, Room
from langflash_core.lab.rooms.render import Picture

PERSON = (0.45, 1.65, 0.3)
"""Width, height and depth, m."""
SCREEN = (0.7, 0.45)
"""Width and height, m."""
TRIES = 60
_SHARE = (0.03, 0.25)  # of a picture, that somebody covers
_SEEING, _MOSTLY = 0.7, 0.7  # of the photos, that see a screen; of the screen
_HEIGHT = 96  # pixels of pictures to prove it
_GAP = 0.02  # relative depth, by which the wall of a screen may be off


@dataclass(frozen=True)
class Screen:
    """A rectangle of a wall. centre, right, up: (3,) world, the latter two half of its sides long."""

    centre: Float[np.ndarray, " 3"]
    right: Float[np.ndarray, " 3"]
    up: Float[np.ndarray, " 3"]

    def seen(self, picture: Picture, viewmat: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (H, W, 2) on the screen, -1 to 1 over it, and where (H, W) a picture shows it."""
        height, width = picture.depth.shape
        v, u = np.mgrid[:height, :width] + 0.5
        rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(K).T  # z = 1
        rays, eye = rays @ viewmat[:3, :3], -viewmat[:3, :3].T @ viewmat[:3, 3]
        normal = np.cross(self.right, self.up)
        along = rays @ normal
        depth = ((self.centre - eye) @ normal) / np.where(np.abs(along) < 1e-9, 1e-9, along)
        arm = eye + rays * depth[..., None] - self.centre
        places = np.stack([arm @ side / (side @ side) for side in (self.right, self.up)], -1)
        inside = (np.abs(places) <= 1).all(-1) & (depth > 0)
        return places, inside & (np.abs(picture.depth / np.where(depth > 0, depth, 1) - 1) < _GAP)

    def shown(
        self, picture: Picture, viewmat: np.ndarray, K: np.ndarray, number: int, bright: float
    ) -> Picture:
        """A picture in which the screen shows its picture of that number, as bright as that."""
        places, inside = self.seen(picture, viewmat, K)
        size = 96
        rng = np.random.default_rng(number)
        content = cv2.resize(rng.uniform(0.05, 1.0, (2, 3, 3)).astype(np.float32), (size, size)) * 2 * bright
        x, y = (((places[..., k] + 1) / 2 * (size - 1)).astype(np.float32) for k in (0, 1))
        colours = cv2.remap(content, x, y, cv2.INTER_LINEAR)
        return replace(picture, radiance=np.where(inside[..., None], colours, picture.radiance))


def with_somebody(
    staged: StagedRoom, renderer: RoomRenderer, viewmat: np.ndarray, K: np.ndarray, seed: int
) -> Room | None:
    """The room with somebody before a camera; None where there is no place for anybody.

    `renderer` has another room afterwards.
    """
    rng = np.random.default_rng([seed, 37])
    small, size = _small(staged, K)
    renderer.set_room(staged.room)
    depth = renderer.draw(viewmat, small, size).depth
    middle = float(np.median(depth[depth > 0])) if (depth > 0).any() else 3.0
    for _ in range(TRIES):
        room = _placed(staged, renderer, viewmat, middle, rng)
        if room is None:
            continue
        renderer.set_room(room)
        share = (renderer.draw(viewmat, small, size).ids == len(room.instances)).mean()
        if _SHARE[0] <= share <= _SHARE[1]:
            return room
    return None


def _placed(
    staged: StagedRoom, renderer: RoomRenderer, viewmat: np.ndarray, middle: float, rng: np.random.Generator
) -> Room | None:
    """The room with somebody at a chance place, unless something stands there."""
    pack, room = renderer.pack, staged.room
    eye, ahead, right = -viewmat[:3, :3].T @ viewmat[:3, 3], viewmat[2, :3], viewmat[0, :3]
    distance = float(np.clip(middle * rng.uniform(0.45, 0.8), 0.9, 3.0))
    foot = eye + distance * (ahead + right * rng.uniform(-0.35, 0.35))
    foot[1] = 0.0
    half = np.array([max(PERSON[0], PERSON[2]) / 2, 0.0, max(PERSON[0], PERSON[2]) / 2])
    low, high = foot - half, foot + half + [0.0, PERSON[1], 0.0]
    things = [i for i in room.instances if i.item >= 0 and i.high[1] > 0.05]
    if any((low < i.high).all() and (high > i.low).all() for i in things):
        return None
    extent = np.array([room.shell.size[0], room.shell.height, room.shell.size[1]])
    if (low < 0).any() or (high > extent).any():
        return None
    known = {i.item for i in room.instances}
    items = [k for k, item in enumerate(pack.items) if k not in known and _upright(item.size)]
    item = int(rng.choice(items))
    yaw = float(rng.uniform(0, 2 * np.pi))
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    model = np.eye(4)
    model[:3, :3] = turn * (np.array(PERSON) / np.array(pack.items[item].size))
    model[:3, 3] = foot
    tint = tuple(float(c) for c in rng.uniform(0.25, 1.0, 3))
    somebody = Instance(item, ("somebody",), "somebody", model, low, high, tint, float(rng.random()))  # pyright: ignore
    return replace(room, instances=(*room.instances, somebody))


def _upright(size: tuple[float, float, float]) -> bool:
    width, height, depth = size
    return height > 0.7 and height > max(width, depth) and min(width, depth) > 0.2


def screen_in(
    staged: StagedRoom, renderer: RoomRenderer, viewmats: list[np.ndarray], K: np.ndarray, seed: int
) -> Screen | None:
    """The place for a screen, of some by chance, that most of these cameras see and see largest; None where
    there is none. `renderer` has this room.
    """
    small, size = _small(staged, K)
    pictures = [renderer.draw(view, small, size) for view in viewmats]
    best, most = None, 0.0
    for screen in _screens(staged, pictures[len(pictures) // 2], viewmats[len(viewmats) // 2], small, seed):
        shares = [_share(screen, p, v, small) for p, v in zip(pictures, viewmats, strict=True)]
        if np.count_nonzero(shares) >= _SEEING * len(shares) and np.mean(shares) > most:
            best, most = screen, float(np.mean(shares))
    return best


def _screens(
    staged: StagedRoom, picture: Picture, viewmat: np.ndarray, K: np.ndarray, seed: int
) -> Iterator[Screen]:
    """Screens on what a picture shows of walls."""
    rng = np.random.default_rng([seed, 38])
    rows, columns = np.nonzero(picture.ids == 1)  # walls
    for pick in rng.integers(len(rows), size=TRIES) if len(rows) else ():
        ray = np.linalg.inv(K) @ [columns[pick] + 0.5, rows[pick] + 0.5, 1.0]
        place = viewmat[:3, :3].T @ (ray * picture.depth[rows[pick], columns[pick]] - viewmat[:3, 3])
        for wall in staged.room.shell.walls:
            inward, start, along = (
                np.array([flat[0], 0.0, flat[1]]) for flat in (wall.inward, wall.start, wall.direction)
            )
            if abs((place - start) @ inward) < 0.03:
                up = np.array([0, -SCREEN[1] / 2, 0])
                yield Screen(place + 0.01 * inward, along * SCREEN[0] / 2, up)


def _share(screen: Screen, picture: Picture, viewmat: np.ndarray, K: np.ndarray) -> float:
    """Of a picture that a screen takes; 0 where it shows less than .7 of the screen."""
    corners = [
        screen.centre + a * screen.right + b * screen.up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    pos = np.stack(corners) @ viewmat[:3, :3].T + viewmat[:3, 3]
    if (pos[:, 2] < 0.3).any():
        return 0.0
    x, y = (pos @ K.T)[:, :2].T / pos[:, 2]
    area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
    _, inside = screen.seen(picture, viewmat, K)
    return float(inside.mean()) if inside.sum() >= _MOSTLY * area else 0.0


def _small(staged: StagedRoom, K: np.ndarray) -> tuple[np.ndarray, tuple[int, int]]:
    """A lens, and (height, width), of pictures to prove what cameras see."""
    height, width = staged.views.depths.shape[1:]
    size = (_HEIGHT, _HEIGHT * width // height)
    ratio = _HEIGHT / (2 * K[1, 2])
    return K * np.array([[ratio], [ratio], [1.0]]), size
