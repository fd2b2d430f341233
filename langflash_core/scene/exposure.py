"""The light of a place: as the photos around it would have taken what is seen from there.

Photos of one room are exposed differently, each as its camera thought best. A scene holds all colours in one
light (`light`), in which what lies before a window is beyond white and what lies in the shade of a lamp below
black. So a picture for people is drawn in the light of its place: at a photo's own place in that photo's, so
that it is the photo; between photos in a mixture; far from all of them in the scene's own,

    log g = sum_v w_v log g_v / (sum_v w_v + 1 / FAR^2),     w_v = 1 / (a_v^2 + d_v^2),

and offsets alike, with a_v the angle to the direction of the photo, radians, and d_v the way to its place in
median distances of the Gaussians; how a photo was held does not matter. What compares pictures of several
places with each other, or makes Gaussians of them, draws in the scene's own light. Web pages do the same
(`export/page/cameras.js`).

Source: own derivation; weights of Shepard 1968, "A two-dimensional interpolation function".
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from langflash_core.geometry import cameras
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.scene.settings import EXPOSURE
from langflash_core.types import Camera, Scene


@dataclass(frozen=True)
class PlaceLight:
    """What the light of any place follows from, float64. poses: camera to world; distance: median, in the
    poses' unit; logs: of gains. Photos in one light: V = 0."""

    poses: Float[np.ndarray, "V 4 4"]
    distance: float
    logs: Float[np.ndarray, "V 3"]
    offsets: Float[np.ndarray, "V 3"]

    @staticmethod
    def of(scene: Scene) -> "PlaceLight":
        light = scene.record.light
        if not light:
            return PlaceLight(np.zeros((0, 4, 4)), 1.0, np.zeros((0, 3)), np.zeros((0, 3)))
        poses = invert_rigid(scene.viewmats.detach().cpu().double()).numpy()
        gains, offsets = (np.array(light[name], dtype=np.float64) for name in ("gains", "offsets"))
        return PlaceLight(poses, median_distance(scene), np.log(gains), offsets)

    def lit(self, camera: Camera) -> Camera:
        """The camera in the light of its place; in none where the photos had one light."""
        if not len(self.poses):
            return camera if camera.light is None else replace(camera, light=None)
        shares = self._shares(camera.viewmat.detach().cpu().double().numpy())
        light = np.stack((np.exp(shares @ self.logs), shares @ self.offsets))
        return replace(camera, light=torch.from_numpy(light).float())

    def _shares(self, viewmat: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, " V"]:
        """What each photo's light counts; in sum up to 1, the rest is the scene's."""
        # |d - d'| = 2 sin(a / 2) of unit directions: small angles keep their digits, which arccos loses
        chords = np.linalg.norm(self.poses[:, :3, 2] - viewmat[2, :3], axis=1)
        angles = 2 * np.arcsin(np.minimum(chords / 2, 1))
        centre = -viewmat[:3, :3].T @ viewmat[:3, 3]
        ways = np.linalg.norm(self.poses[:, :3, 3] - centre, axis=1) / self.distance
        weights = 1 / (angles**2 + ways**2 + EXPOSURE.here**2)
        return weights / (weights.sum() + 1 / EXPOSURE.far**2)


def lit_camera(scene: Scene, camera: Camera) -> Camera:
    """The camera in the light of its place; of many cameras of one scene ask a `PlaceLight`."""
    return PlaceLight.of(scene).lit(camera)


def median_distance(scene: Scene) -> float:
    """Of some Gaussians from the first photo's place; 1 where there is none."""
    return cameras.median_distance(scene.gaussians.means, scene.viewmats[0])
