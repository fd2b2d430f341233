"""Where the person stands: a pose to orbit, pan, zoom and fly with, as pure functions.

Conventions of the core: OpenCV axes, world = camera of view 0, quaternions wxyz. Up is -y, because view 0
was held roughly level, where nobody knows better (`langflash_core.base.records.World`). A pose frames a *box*
with the shape of the photos inside a panel of any shape. In a wider one it is out of sight above and below by
as much as it leaves bars aside: whole, an upright photo stands between black bars, and without bars it loses
most of its height. By parallel rays, and in a narrower panel, all of it shows.

A pose with a `span` sees by parallel rays (orthographic). It stands clear of the scene, since what is
behind it is not drawn: how large things are follows from the span, not from where it stands.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Num

from langflash_core.geometry import rotations
from langflash_core.geometry.pinhole import Seen, see
from langflash_core.geometry.reach import MIN_REACH
from langflash_core.geometry.rotations import about

if TYPE_CHECKING:
    from langflash_core.types import Camera

UP = np.array([0.0, -1.0, 0.0])
NEAREST = 0.02  # scene units in front of the camera from which something is marked in the picture
MIN_POLE_DEGREES = 4.0  # how near to straight up or down an orbit may come
FOV_RANGE = (15.0, 120.0)
FRAME_MARGIN = 1.08  # around what is framed
MAGNIFIED = 1.6  # that a photo is at the most, in a picture wider than it
FRAMED_IN = 1.6  # width / height of the picture in which what is framed shows whole: a window's
NEAR = 45.0  # degrees aside of the photos to which a look along an axis keeps
STAY, FLIGHT = 1.5, 2.5  # seconds at a stop of a tour, and to the next one


class Vector(NamedTuple):
    """A point or direction, world axes, scene units."""

    x: float
    y: float
    z: float


class Rotation(NamedTuple):
    """A unit quaternion."""

    w: float
    x: float
    y: float
    z: float


ORIGIN = Vector(0.0, 0.0, 0.0)
UNTURNED = Rotation(1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Pose:
    """A camera a person can move.

    centre: scene units. rotation: camera to world. reach: distance to the pivot along the
    viewing direction, scene units. fov: degrees over the longer side of the photo box.
    aspect: width / height of the box. shift: principal point minus the box's middle, in box
    widths and heights. span: of parallel rays, scene units along the longer side of the box; None
    sees in perspective.
    """

    centre: Vector = ORIGIN
    rotation: Rotation = UNTURNED
    reach: float = 1.0
    fov: float = 60.0
    aspect: float = 4 / 3
    shift: tuple[float, float] = (0.0, 0.0)
    span: float | None = None

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Camera to world rotation (3, 3); its columns are right, down, forward."""
        return rotations.matrix(self.rotation)

    @property
    def pivot(self) -> Float[np.ndarray, "3"]:
        """The point (3,) that orbits turn around."""
        return np.array(self.centre) + self.reach * self.axes[:, 2]

    @property
    def distance(self) -> float:
        """From where the pivot looks as large in perspective as it does: `reach`, without a span."""
        return self.reach if self.span is None else 0.5 * self.span / math.tan(math.radians(self.fov) / 2)


START = Pose()  # of an empty window


def from_view(
    viewmat: Float[np.ndarray, "4 4"],
    K: Float[np.ndarray, "3 3"],
    size: tuple[int, int],
    reach: float,
    orthographic: bool = False,
) -> Pose:
    """The pose of an input view: viewmat (4, 4) world to camera, K (3, 3), size (width, height)."""
    width, height = size
    axes = viewmat[:3, :3].T
    longer = max(width, height) / float(K[0, 0] if width >= height else K[1, 1])
    return Pose(
        centre=Vector(*(-axes @ viewmat[:3, 3]).tolist()),
        rotation=_rotation(axes),
        reach=max(float(reach), MIN_REACH),
        fov=START.fov if orthographic else math.degrees(2 * math.atan(0.5 * longer)),
        aspect=width / height,
        shift=(float(K[0, 2]) / width - 0.5, float(K[1, 2]) / height - 0.5),
        span=longer if orthographic else None,
    )


def intrinsics(pose: Pose, width: int, height: int) -> Float[np.ndarray, "3 3"]:
    """K (3, 3) in pixels of a width x height picture around the pose's box; with a span, focal lengths in
    pixels per scene unit."""
    box_width, box_height = box_in(pose, width, height)
    longer = max(box_width, box_height)
    focal = 0.5 * longer / math.tan(math.radians(pose.fov) / 2) if pose.span is None else longer / pose.span
    centre_x = width / 2 + pose.shift[0] * box_width
    centre_y = height / 2 + pose.shift[1] * box_height
    return np.array([[focal, 0.0, centre_x], [0.0, focal, centre_y], [0.0, 0.0, 1.0]])


def box_in(pose: Pose, width: float, height: float) -> tuple[float, float]:
    """Width and height of the pose's box in a picture so wide and high, around its middle."""
    box_width = min(width, height * pose.aspect)
    if pose.span is None:  # halfway between all of it and no bars, as on exported pages
        box_width *= min(math.sqrt(width / box_width), MAGNIFIED)
    return box_width, box_width / pose.aspect


def of_picture(pose: Pose, width: float, height: float) -> Pose:
    """The pose whose box is all of a picture, so many pixels wide and high, of this one; as it is where it
    sees by parallel rays."""
    if pose.span is not None:
        return pose
    size = max(round(width), 1), max(round(height), 1)
    return with_lens(pose, from_view(viewmat(pose), intrinsics(pose, *size), size, pose.reach))


def with_lens(pose: Pose, other: Pose) -> Pose:
    """The pose with the field of view and the box of another."""
    return replace(pose, fov=other.fov, aspect=other.aspect, shift=other.shift)


def viewmat(pose: Pose) -> Float[np.ndarray, "4 4"]:
    """World to camera (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = pose.axes.T
    matrix[:3, 3] = -pose.axes.T @ np.array(pose.centre)
    return matrix


def to_camera(pose: Pose, width: int, height: int) -> "Camera":
    """The core's camera, float32, for a picture of width x height pixels."""
    import torch  # the first frame is drawn before torch is needed

    from langflash_core.types import Camera

    return Camera(
        torch.tensor(viewmat(pose), dtype=torch.float32),
        torch.tensor(intrinsics(pose, width, height), dtype=torch.float32),
        width,
        height,
        pose.span is not None,
    )


def project(
    points: Num[np.ndarray, "n 3"], pose: Pose, size: tuple[float, float]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 2"]] | None:
    """Depths and pixels of world points in a picture of `size`; None where one is not in front."""
    seen = _see(points, pose, size)
    return None if seen.z.min() < NEAREST else (seen.z, np.stack((seen.x, seen.y), 1))


def visible(
    line: Num[np.ndarray, "n 3"], pose: Pose, size: tuple[float, float]
) -> Float[np.ndarray, "m 2 2"]:
    """The pieces between points of a line that lie in front, as pixels (m, start and end, 2) in a picture of
    `size`."""
    seen = _see(line, pose, size)
    pixels, ahead = np.stack((seen.x, seen.y), 1), seen.z >= NEAREST
    return np.stack((pixels[:-1], pixels[1:]), 1)[ahead[:-1] & ahead[1:]]


def _see(points: Num[np.ndarray, "n 3"], pose: Pose, size: tuple[float, float]) -> Seen:
    """Points in the picture of a pose, of whole pixels, one at least."""
    sides = max(round(size[0]), 1), max(round(size[1]), 1)
    return see(points, viewmat(pose), intrinsics(pose, *sides), sides, orthographic=pose.span is not None)


def orthographic(pose: Pose, low: Vector, high: Vector) -> Pose:
    """The pose by parallel rays, the pivot as large as before, clear of the box from `low` to `high`."""
    span = 2 * pose.distance * math.tan(math.radians(pose.fov) / 2)
    return _clear(replace(pose, span=max(span, MIN_REACH)), low, high)


def perspective(pose: Pose) -> Pose:
    """The pose without a span, the pivot as large as before."""
    return _at_reach(replace(pose, span=None), max(pose.distance, MIN_REACH))


def _clear(pose: Pose, low: Vector, high: Vector) -> Pose:
    """Stepped back from the pivot until it can turn around it with the whole box ahead."""
    corners = np.maximum(np.abs(np.array(low) - pose.pivot), np.abs(np.array(high) - pose.pivot))
    return _at_reach(pose, max(pose.reach, FRAME_MARGIN * float(np.linalg.norm(corners)) + NEAREST))


def _at_reach(pose: Pose, reach: float) -> Pose:
    """So far from the same pivot."""
    centre = pose.pivot - reach * pose.axes[:, 2]
    return replace(pose, centre=Vector(*centre.tolist()), reach=reach)


def orbit(
    pose: Pose,
    yaw: float,
    pitch: float,
    up: Float[np.ndarray, "3"] = UP,
    pivot: Float[np.ndarray, "3"] | None = None,
) -> Pose:
    """Turn around a point, radians: yaw about up (unit), pitch about the camera's x axis.

    pivot: (3,) world, which stays where it is in the picture; None: the pose's own.
    """
    return around(pose, look(pose, yaw, pitch, up), pivot)


def around(pose: Pose, turned: Pose, pivot: Float[np.ndarray, "3"] | None = None) -> Pose:
    """The pose turned as far as another from its place, but around a pivot (3,), which then is as far ahead
    as it looks deep; None: its own."""
    if pivot is None or pose.span is not None:  # by parallel rays `reach` keeps the scene ahead
        centre = pose.pivot - pose.reach * turned.axes[:, 2]
        return replace(turned, centre=Vector(*centre.tolist()))
    way = pose.axes.T @ (np.array(pose.centre) - pivot)  # in camera axes, which it keeps
    return replace(
        turned, centre=Vector(*(pivot + turned.axes @ way).tolist()), reach=max(-way[2], MIN_REACH)
    )


def degrees_aside(pose: Pose, places: Sequence[Vector]) -> float:
    """Angle at the pivot between the camera and the nearest of some places, at least one."""
    own, others = np.array(pose.centre) - pose.pivot, np.array(places) - pose.pivot
    lengths = np.linalg.norm(own) * np.linalg.norm(others, axis=1)
    cosine = float(np.max(others @ own / np.maximum(lengths, 1e-12)))
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def look(pose: Pose, yaw: float, pitch: float, up: Float[np.ndarray, "3"] = UP) -> Pose:
    """Turn on the spot, radians; stops short of the poles so that up (unit) stays up."""
    axes = about(up, yaw) @ pose.axes
    from_pole = math.acos(float(np.clip(axes[:, 2] @ up, -1.0, 1.0)))
    floor = math.radians(MIN_POLE_DEGREES)
    # Looking up shrinks the angle to the pole: a positive pitch turns the view upwards.
    lowest, highest = min(floor - from_pole, 0.0), max(math.pi - floor - from_pole, 0.0)
    pitch = -float(np.clip(-pitch, lowest, highest))
    return replace(pose, rotation=_rotation(about(axes[:, 0], pitch) @ axes))


def roll(pose: Pose, up: Float[np.ndarray, "3"]) -> float:
    """Radians by which the picture is turned about its own direction, from one that stands upright; 0 where
    it looks straight up or down."""
    across, along = pose.axes[:, 0] @ up, pose.axes[:, 1] @ up
    return 0.0 if math.hypot(across, along) < 1e-6 else math.atan2(-across, -along)


def make_upright(pose: Pose, up: Float[np.ndarray, "3"], share: float = 1.0) -> Pose:
    """The pose from the same place in the same direction, upright; or so much of the way there."""
    turn = -share * roll(pose, up)
    return replace(pose, rotation=_rotation(about(pose.axes[:, 2], turn) @ pose.axes)) if turn else pose


def pan(pose: Pose, right: float, down: float) -> Pose:
    """Slide in the picture plane, scene units; the pivot moves along."""
    return fly(pose, right, down, 0.0)


def fly(pose: Pose, right: float, down: float, forward: float) -> Pose:
    """Move along the camera's own axes, scene units; with a span, forward comes nearer as `zoom` does."""
    if pose.span is not None:
        pose, forward = zoom(pose, math.exp(-forward / pose.distance)), 0.0
    step = pose.axes @ np.array([right, down, forward])
    return replace(pose, centre=Vector(*(np.array(pose.centre) + step).tolist()))


def zoom(pose: Pose, factor: float) -> Pose:
    """Scale the distance to the pivot, or the span; a factor below 1 comes nearer."""
    if pose.span is not None:
        return replace(pose, span=max(pose.span * factor, MIN_REACH))
    return _at_reach(pose, max(pose.reach * factor, MIN_REACH))


def facing(pose: Pose, forward: Vector, up: Float[np.ndarray, "3"] = UP) -> Pose:
    """The pose that looks along a direction at the same pivot, upright; straight up or down, with the
    picture's right side where it was."""
    ahead = np.array(forward) / np.linalg.norm(forward)
    right = np.cross(-up, ahead)
    if np.linalg.norm(right) < 1e-6:
        right = pose.axes[:, 0] - (pose.axes[:, 0] @ ahead) * ahead
    right /= np.linalg.norm(right)
    axes = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    centre = pose.pivot - pose.reach * ahead
    return replace(pose, centre=Vector(*centre.tolist()), rotation=_rotation(axes))


def facing_near(
    pose: Pose, forward: Vector, places: Sequence[Vector], up: Float[np.ndarray, "3"] = UP
) -> Pose:
    """`facing`, no farther than `NEAR` degrees from the nearest of some places, as the pivot sees them: from
    there on the way to where it should look from."""
    there = facing(pose, forward, up)
    if not places or degrees_aside(there, places) <= NEAR:
        return there
    wanted = -there.axes[:, 2]
    ways = np.array(places) - pose.pivot
    ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    nearest = ways[np.argmax(ways @ wanted)]
    axis = np.cross(nearest, wanted)
    if np.linalg.norm(axis) < 1e-6:  # right behind what the photo looked at: around it
        axis = up
    direction = about(axis / np.linalg.norm(axis), math.radians(NEAR)) @ nearest
    return facing(pose, Vector(*(-direction).tolist()), up)


def with_fov(pose: Pose, degrees: float) -> Pose:
    """Another field of view, clamped to `FOV_RANGE`."""
    return replace(pose, fov=float(np.clip(degrees, *FOV_RANGE)))


def units_per_pixel(pose: Pose, width: int, height: int) -> float:
    """Scene units that one pixel spans at the pivot's depth."""
    depth = pose.reach if pose.span is None else 1.0
    return depth / float(intrinsics(pose, width, height)[0, 0])


def framing(pose: Pose, low: Vector, high: Vector) -> Pose:
    """The pose that looks the same way and shows the whole box from `low` to `high`, with a margin."""
    corners = np.array([[x, y, z] for x in (low.x, high.x) for y in (low.y, high.y) for z in (low.z, high.z)])
    middle = (np.array(low) + np.array(high)) / 2
    offsets = (corners - middle) @ pose.axes  # (8, 3) right, down, forward
    if pose.span is not None:
        across, along = abs(offsets[:, 0]).max(), abs(offsets[:, 1]).max()
        widest = max(across, along * pose.aspect)  # half the box's width
        span = 2 * FRAME_MARGIN * float(widest / min(pose.aspect, 1.0))
        centre = middle - pose.reach * pose.axes[:, 2]
        there = replace(pose, centre=Vector(*centre.tolist()), span=max(span, MIN_REACH))
        return _clear(there, low, high)
    half = math.tan(math.radians(pose.fov) / 2)
    half_x, half_y = (half, half / pose.aspect) if pose.aspect >= 1 else (half * pose.aspect, half)
    half_y /= max(box_in(pose, FRAMED_IN, 1.0)[1], 1.0)
    needed = np.maximum(abs(offsets[:, 0]) / half_x, abs(offsets[:, 1]) / half_y) - offsets[:, 2]
    reach = max(float(FRAME_MARGIN * needed.max()), MIN_REACH)
    centre = middle - reach * pose.axes[:, 2]
    return replace(pose, centre=Vector(*centre.tolist()), reach=reach)


def blend(start: Pose, end: Pose, fraction: float, up: Float[np.ndarray, "3"] | None = None) -> Pose:
    """Between two poses: slerp of the rotations, smooth start and stop; exact at both ends.

    Between perspective and parallel rays the way is one in perspective. up: unit; heading, pitch and roll go
    their own ways instead, so that between two level pictures all are.
    """
    if fraction <= 0.0:
        return start
    if fraction >= 1.0:
        return end
    start, end = alike((start, end))
    t = fraction * fraction * (3.0 - 2.0 * fraction)

    def mix(a: float, b: float) -> float:
        return a + t * (b - a)

    return Pose(
        centre=Vector(*(mix(a, b) for a, b in zip(start.centre, end.centre, strict=True))),
        rotation=Rotation(*rotations.slerp(start.rotation, end.rotation, t))
        if up is None
        else _between(start, end, t, up),
        reach=mix(start.reach, end.reach),
        fov=mix(start.fov, end.fov),
        aspect=mix(start.aspect, end.aspect),
        shift=(mix(start.shift[0], end.shift[0]), mix(start.shift[1], end.shift[1])),
        span=None if start.span is None or end.span is None else mix(start.span, end.span),
    )


def _between(start: Pose, end: Pose, t: float, up: np.ndarray) -> Rotation:
    """The rotation a share t of the way, by heading, pitch and roll."""
    level = np.linalg.svd(up[None])[2][1:]  # (2, 3) two directions across up
    first, last = (np.array(_angles(pose, up, level)) for pose in (start, end))
    way = (last - first + math.pi) % (2 * math.pi) - math.pi  # the shorter way around
    heading, pitch, rolled = first + t * way
    right = math.cos(heading) * level[0] + math.sin(heading) * level[1]
    ahead = math.cos(pitch) * np.cross(up, right) + math.sin(pitch) * up
    axes = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    return _rotation(about(ahead, rolled) @ axes)


def _angles(pose: Pose, up: np.ndarray, level: np.ndarray) -> tuple[float, float, float]:
    """Heading of the picture's right side, pitch and roll, radians."""
    across = level @ make_upright(pose, up).axes[:, 0]
    pitch = math.asin(min(max(float(pose.axes[:, 2] @ up), -1.0), 1.0))
    return math.atan2(across[1], across[0]), pitch, roll(pose, up)


def tour_seconds(count: int) -> float:
    """How long a tour of so many stops takes: `STAY` at each of them, `FLIGHT` between two."""
    return STAY * count + FLIGHT * (count - 1)


def on_tour(stops: Sequence[Pose], passed: float) -> Pose:
    """Where a tour is that began so many seconds ago: it stays at every stop, at least one, for a while and
    flies smoothly to the next."""
    place, since = divmod(max(passed, 0.0), STAY + FLIGHT)
    here = min(int(place), len(stops) - 1)
    there = min(here + 1, len(stops) - 1)
    return blend(stops[here], stops[there], max(0.0, since - STAY) / FLIGHT)


def tour_place(count: int, passed: float) -> int:
    """The number of the stop where `on_tour` stays or flies to, of so many."""
    place, since = divmod(max(passed, 0.0), STAY + FLIGHT)
    return min(int(place) + (since > STAY), count - 1)


def alike(all_poses: Sequence[Pose]) -> tuple[Pose, ...]:
    """As they are where all see by parallel rays, else all in perspective."""
    flat = all(pose.span is not None for pose in all_poses)
    return tuple(pose if flat or pose.span is None else perspective(pose) for pose in all_poses)


def told_pose(pose: Pose) -> dict[str, Any]:
    """A pose as plain values, as a file gives them back."""
    lists = ("centre", "rotation", "shift")
    return asdict(pose) | {name: list(getattr(pose, name)) for name in lists}


def read_pose(entry: Mapping[str, Any]) -> Pose:
    """A pose out of a file; one of an earlier version has no span.

    Raises:
        KeyError, TypeError, ValueError, IndexError: it is damaged, or no picture can be drawn from there.
    """
    pose = Pose(
        Vector(*map(float, entry["centre"])),
        Rotation(*map(float, entry["rotation"])),
        *(float(entry[name]) for name in ("reach", "fov", "aspect")),
        shift=(float(entry["shift"][0]), float(entry["shift"][1])),
        span=None if entry.get("span") is None else float(entry["span"]),
    )
    if not _can_look(pose):
        raise ValueError(f"pose: expected one from which a picture can be drawn, received {pose}")
    return pose


def _can_look(pose: Pose) -> bool:
    span = 1.0 if pose.span is None else pose.span
    numbers = (*pose.centre, *pose.rotation, pose.reach, pose.fov, pose.aspect, *pose.shift, span)
    turned = sum(part * part for part in pose.rotation)
    return (
        all(map(math.isfinite, numbers))
        and turned > 0
        and pose.reach > 0
        and 0 < pose.fov < 180
        and pose.aspect > 0
        and span > 0
    )


def _rotation(axes: np.ndarray) -> Rotation:
    return Rotation(*rotations.quaternion(axes))
