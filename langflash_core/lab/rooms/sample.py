"""One training or test sample: a room seen in V views. H W pixels; world = first camera, metres."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, UInt8

from langflash_core.lab.rooms.cameras import (
    MAX_SHARE,
    MIN_MEDIAN_DEPTH,
    MIN_OVERLAP,
    CameraSet,
    overlap_fraction,
    propose_cameras,
)
from langflash_core.lab.rooms.catalogue import TRAIN_LIBRARIES
from langflash_core.lab.rooms.layout import Room, make_room
from langflash_core.lab.rooms.pack import Pack
from langflash_core.lab.rooms.render import Picture, RoomRenderer
from langflash_core.lab.rooms.sensor import Sensor, expose, meter, random_sensor

_ROOM_TRIES = 60
_STRUCTURAL = 3  # wall, floor, ceiling
_MIN_THINGS, _SMALL_SHARE = 3, 0.002  # a picture shows some things, each at least this large


@dataclass(frozen=True)
class RoomViews:
    """Pictures of one room with everything known about them.

    Attributes:
        images: sRGB photos.
        depths: z-depth, m; 0 where nothing (outside a window).
        instances: index into names and groups; 0 = nothing.
        names: per instance: catalogue name first, then synonyms and the group word, lower case; () for 0.
        groups: per instance: class group ("chair", "wall"), "" for 0.
        viewmats: world -> camera, OpenCV axes; world = first camera.
        Ks: intrinsics, pixels.
        overlap: fraction of view-0 pixels visible in view 1; 1 for a single view.
        seed: what the sample was made from.
    """

    images: UInt8[np.ndarray, "V H W 3"]
    depths: Float[np.ndarray, "V H W"]
    instances: UInt8[np.ndarray, "V H W"]
    names: tuple[tuple[str, ...], ...]
    groups: tuple[str, ...]
    viewmats: Float[np.ndarray, "V 4 4"]
    Ks: Float[np.ndarray, "V 3 3"]
    overlap: float
    seed: int


@dataclass(frozen=True)
class StagedRoom:
    """A sample, and what it takes to look at its room from elsewhere.

    Attributes:
        views: the sample.
        room: what is drawn.
        home: world of the room (y up) -> world of the sample, the first camera.
        sensor: that took all photos. grey: what it was brought to (`meter`).
    """

    views: RoomViews
    room: Room
    home: Float[np.ndarray, "4 4"]
    sensor: Sensor
    grey: float

    def look(
        self,
        renderer: RoomRenderer,
        viewmat: Float[np.ndarray, "4 4"],
        K: Float[np.ndarray, "3 3"],
        size: tuple[int, int],
    ) -> tuple[UInt8[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]:
        """Photo and z-depth (m, 0 where nothing) of the room that `renderer` was last given.

        The photo is exposed as the sample's are, but through a perfect lens and sensor: no vignette,
        blur, noise or JPEG.

        Args:
            viewmat: world of the sample -> camera. K: pixels. size: (height, width).
        """
        picture = renderer.draw(viewmat @ self.home, K, size)
        perfect = replace(self.sensor, vignette=0.0, noise=0.0, blur=0.0, quality=0)
        return expose(picture.radiance, perfect, np.random.default_rng(0), self.grey), picture.depth


def staged_room(
    seed: int,
    pack: Pack,
    renderer: RoomRenderer,
    *,
    num_views: int = 2,
    size: tuple[int, int] = (224, 224),
    libraries: tuple[str, ...] = TRAIN_LIBRARIES,
) -> StagedRoom:
    """Lay out a room, choose cameras, draw and photograph it; the same seed gives the same sample.

    Args:
        seed: non-negative.
        pack: furniture.
        renderer: drawer of the same pack.
        num_views: V, 1 or more.
        size: (height, width), pixels.
        libraries: whose furniture may appear.

    Returns:
        Views that overlap by at least 0.25, with a median depth of at least 0.6 m and no thing
        that fills more than 75 % of a picture.

    Raises:
        ValueError: bad arguments, or no such view was found in many rooms.
    """
    if num_views < 1 or min(size) < 1 or seed < 0:
        raise ValueError(
            f"seed, num_views, size: expected >= 0, >= 1, positive, got {seed}, {num_views}, {size}"
        )
    for attempt in range(_ROOM_TRIES):
        rng = np.random.default_rng([seed, attempt])
        room = make_room(int(rng.integers(2**62)), pack, libraries)
        cameras = propose_cameras(rng, room, num_views, size)
        if cameras is None:
            continue
        renderer.set_room(room)
        pictures = _draw_good(renderer, cameras, size)
        if pictures is None:
            continue
        overlap = _least_overlap(pictures, cameras)
        if overlap is not None:
            return _staged(seed, room, cameras, pictures, overlap, rng)
    raise ValueError(
        f"seed: no usable views in {_ROOM_TRIES} rooms of seed {seed}; libraries {libraries} may be too poor"
    )


def _draw_good(renderer: RoomRenderer, cameras: CameraSet, size: tuple[int, int]) -> list[Picture] | None:
    """All pictures, or None as soon as one is blocked."""
    pictures = []
    for viewmat, K in zip(cameras.viewmats, cameras.Ks, strict=True):
        picture = renderer.draw(viewmat, K, size)
        if _blocked(picture):
            return None
        pictures.append(picture)
    return pictures


def _blocked(picture: Picture) -> bool:
    seen = picture.depth[picture.depth > 0]
    shares = np.bincount(picture.ids.ravel(), minlength=_STRUCTURAL + 1) / picture.ids.size
    things = int((shares[_STRUCTURAL + 1 :] > _SMALL_SHARE).sum())
    if len(seen) < 0.5 * picture.depth.size or things < _MIN_THINGS:
        return True
    return float(np.median(seen)) < MIN_MEDIAN_DEPTH or float(shares.max()) > MAX_SHARE


def _least_overlap(pictures: list[Picture], cameras: CameraSet) -> float | None:
    """Overlap of views 0 and 1; None when any view shares too little with view 0."""
    shared = [
        overlap_fraction(np.stack([pictures[0].depth, p.depth]), cameras.viewmats[[0, k]], cameras.Ks[[0, k]])
        for k, p in enumerate(pictures)
        if k > 0
    ]
    if any(s < MIN_OVERLAP for s in shared):
        return None
    return shared[0] if shared else 1.0


def _staged(
    seed: int,
    room: Room,
    cameras: CameraSet,
    pictures: list[Picture],
    overlap: float,
    rng: np.random.Generator,
) -> StagedRoom:
    sensor = random_sensor(rng)
    grey = float(np.mean([meter(p.radiance) for p in pictures]))
    ids = np.stack([p.ids for p in pictures])
    present = [int(i) for i in np.unique(ids) if i > 0]
    relabel = np.zeros(len(room.instances) + 1, dtype=np.uint8)
    relabel[present] = np.arange(1, len(present) + 1)
    kept = [room.instances[i - 1] for i in present]
    home = np.linalg.inv(cameras.viewmats[0])
    views = RoomViews(
        images=np.stack([expose(p.radiance, sensor, rng, grey) for p in pictures]),
        depths=np.stack([p.depth for p in pictures]).astype(np.float32),
        instances=relabel[ids],
        names=((), *(i.names for i in kept)),
        groups=("", *(i.group for i in kept)),
        viewmats=(cameras.viewmats @ home).astype(np.float32),
        Ks=cameras.Ks.astype(np.float32),
        overlap=overlap,
        seed=seed,
    )
    return StagedRoom(views, room, cameras.viewmats[0], sensor, grey)
