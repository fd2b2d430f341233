"""One scene of a room brought onto another, by what their photos share.

Both stand level and along the room's walls, so one comes onto the other by one of four quarter turns, a
scale and a shift. Key points of the photos inside the scenes are matched; each is a place in its own scene,
by the depth drawn there; of many pairs of matches each tells a scale and a shift, and the turn, scale and
shift that most matches agree with win. What moved is in the minority there, like what matches wrongly.

Sizes: n matches.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from langflash_core.base.picture_files import decoded_photo
from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.inventory.settings import ALIGNMENT
from langflash_core.inventory.things import Inventory
from langflash_core.language.settings import ANSWERING
from langflash_core.types import Camera, Frame

Render = Callable[..., Frame]  # (scene, camera, weight_maps=True)


@dataclass(frozen=True)
class Fit:
    """From places of the second inventory's world to the first's: scale turn p + shift. matches: that agree,
    of how many (`tried`)."""

    turn: Float[np.ndarray, "3 3"] = field(repr=False)
    scale: float
    shift: Float[np.ndarray, " 3"] = field(repr=False)
    matches: int
    tried: int

    def placed(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the second world in the first."""
        return self.scale * points @ self.turn.T + self.shift

    @property
    def inverse(self) -> "Fit":
        """From places of the first world to the second's."""
        return replace(
            self, turn=self.turn.T, scale=1 / self.scale, shift=-self.shift @ self.turn / self.scale
        )


def align_scenes(first: Inventory, second: Inventory, render: Render) -> Fit:
    """Raises InputError: a scene holds no photos, too few of their key points match, or lengths that were
    told for both differ by too much."""
    for found in (first, second):
        if not found.scene.photos:
            raise InputError("scenes are compared by their photos, and one has none; name scenes of photos")
    ours, theirs = _match_keypoints(_describe_keypoints(first, render), _describe_keypoints(second, render))
    metres = first.unit == second.unit == "m"
    told = metres and not (first.guess or second.guess)
    for most in ALIGNMENT.scales if metres else ALIGNMENT.scales[1:]:
        fit = _fit_transform(ours, theirs, first.metre, most)
        if fit is None or fit.matches < max(ALIGNMENT.least, ALIGNMENT.agree * fit.tried):
            continue
        if told and most > ALIGNMENT.scales[0]:
            times = max(fit.scale, 1 / fit.scale)
            raise InputError(
                f"lengths were told for both scenes, and they differ by {times:.1f} times; tell them again"
            )
        return fit
    raise InputError("the photos of both scenes show too little in common; take some from the same places")


def _describe_keypoints(found: Inventory, render: Render) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) in the world of all photos' key points, and their descriptors (n, 128)."""
    places: list[np.ndarray] = [np.zeros((0, 3))]
    descriptors: list[np.ndarray] = [np.zeros((0, 128), np.float32)]
    sift = cv2.SIFT.create(ALIGNMENT.points, contrastThreshold=0.01)
    for view, photo in enumerate(found.scene.photos):
        grey = decoded_photo(photo, "L")
        points, described = ([], None) if grey is None else sift.detectAndCompute(grey.copy(), None)
        if grey is None or described is None:
            continue
        camera = found.scene.camera(view)
        frame = render(found.scene, camera, weight_maps=False)
        pixels = np.array([point.pt for point in points]) + 0.5
        pixels *= np.array([camera.width / grey.shape[1], camera.height / grey.shape[0]])
        own, whole = _world_places(found, camera, frame, pixels)
        places.append(own[whole])
        descriptors.append(described[whole].astype(np.float32))
    return np.concatenate(places), np.concatenate(descriptors)


def _world_places(
    found: Inventory, camera: Camera, frame: Frame, pixels: Float[np.ndarray, "n 2"]
) -> tuple[np.ndarray, np.ndarray]:
    """Where pixels are in the world, and which show something."""
    columns, rows = pixels.astype(int).T
    columns, rows = columns.clip(0, camera.width - 1), rows.clip(0, camera.height - 1)
    depths = frame.depths.cpu().double().numpy()[rows, columns]
    covered = frame.alphas.cpu().numpy()[rows, columns] >= ANSWERING.covered_alpha
    rays = np.concatenate((pixels, np.ones((len(pixels), 1))), 1) @ np.linalg.inv(camera.K.double().numpy()).T
    pose = invert_rigid(camera.viewmat.double()).cpu().numpy()
    points = (rays * depths[:, None]) @ pose[:3, :3].T + pose[:3, 3]
    return found.stand(points), covered & (depths > 0)


def _match_keypoints(ours, theirs) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) of key points that are each other's nearest, in both worlds."""
    if min(len(ours[1]), len(theirs[1])) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    there = {
        m.queryIdx: m.trainIdx
        for m, n in matcher.knnMatch(ours[1], theirs[1], k=2)
        if m.distance < ALIGNMENT.ratio * n.distance
    }
    back = {m.queryIdx: m.trainIdx for (m,) in matcher.knnMatch(theirs[1], ours[1], k=1)}
    both = [(a, b) for a, b in there.items() if back.get(b) == a]
    rows = np.array(both, int).reshape(-1, 2)
    return ours[0][rows[:, 0]], theirs[0][rows[:, 1]]


def _fit_transform(
    ours: Float[np.ndarray, "n 3"],
    theirs: Float[np.ndarray, "n 3"],
    metre: float,
    most: float = ALIGNMENT.scales[1],
) -> Fit | None:
    """The quarter turn, scale (1 / `most` to `most`) and shift that most matches agree with, then exact on
    those."""
    if len(ours) < 2:
        return None
    rng, best, chosen = np.random.default_rng(0), np.zeros(len(ours), bool), None
    pairs = rng.integers(len(ours), size=(ALIGNMENT.tries, 2))
    for quarter, (a, b) in itertools.product(range(4), pairs):
        turn = Rotation.from_euler("y", 90 * quarter, degrees=True).as_matrix()
        step, own = turn @ (theirs[b] - theirs[a]), ours[b] - ours[a]
        length = float(np.linalg.norm(step))
        if length < 0.3 * metre or own @ step < 0.98 * np.linalg.norm(own) * length:
            continue
        scale = float(np.linalg.norm(own)) / length
        if not 1 / most < scale < most:
            continue
        shift = ours[a] - scale * turn @ theirs[a]
        agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < ALIGNMENT.near * metre
        if agree.sum() > best.sum():
            best, chosen = agree, turn
    if chosen is None or best.sum() < 3:
        return None
    turn, scale, shift = _similarity(ours, theirs, best, metre)
    agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < ALIGNMENT.near * metre
    return Fit(turn, scale, shift, int(agree.sum()), len(ours))


def _similarity(ours, theirs, agree, metre: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Of least squares over the matches that agree, which are chosen anew a few times.

    Source: Umeyama 1991.
    """
    turn, scale, shift = np.eye(3), 1.0, np.zeros(3)
    for _ in range(4):
        if agree.sum() < 3:
            break
        a, b = ours[agree], theirs[agree]
        middle_a, middle_b = a.mean(0), b.mean(0)
        u, values, v = np.linalg.svd((a - middle_a).T @ (b - middle_b))
        signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
        turn = (u * signs) @ v
        scale = float((values * signs).sum() / ((b - middle_b) ** 2).sum())
        shift = middle_a - scale * turn @ middle_b
        agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < ALIGNMENT.near * metre
    return turn, scale, shift
