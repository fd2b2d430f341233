"""The light of a place: as the photos around it would have taken what is seen from there.

Photos of one room are exposed differently, each as its camera thought best. A scene holds all colours in one
light (`light`), in which what lies before a window is beyond white and what lies in the shade of a lamp below
black. So a picture for people is drawn in the light of its place: at a photo's own place in that photo's, so
that it is the photo; between photos in a mixture; far from all of them in the scene's own,

    log g = sum_v w_v log g_v / (sum_v w_v + 1 / FAR^2),     w_v = 1 / (a_v^2 + d_v^2),

and offsets alike, with a_v the angle to the photo's direction, radians, and d_v the way to its place in
median distances of the Gaussians. What compares pictures of several places with each other, or makes
Gaussians of them, draws in the scene's own light. `shaders/web` pages do the same (`page/cameras.js`).

Source: own derivation; weights of Shepard 1968, "A two-dimensional interpolation function".
"""

from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.types import Camera, Scene

FAR = 0.25
"""Radians: so far from the only photo, a picture is half in its light."""
HERE = 1e-4  # radians, within which a place is a photo's own
_SAMPLES = 1000  # Gaussians that tell the median distance


def lit_camera(scene: Scene, camera: Camera) -> Camera:
    """The camera in the light of its place; as it is where the photos had one light, or rays are parallel."""
    light = scene.record.light
    if not light or camera.orthographic:
        return camera
    shares = _shares(scene, camera.viewmat)
    gains, offsets = (torch.tensor(light[name], dtype=torch.float64) for name in ("gains", "offsets"))
    own = torch.stack(((shares @ gains.log()).exp(), shares @ offsets))
    return replace(camera, light=own.float())


def _shares(scene: Scene, viewmat: Float[Tensor, "4 4"]) -> Float[Tensor, " V"]:
    """What each photo's light counts (V,) float64; in sum up to 1, the rest is the scene's."""
    places = invert_rigid(scene.viewmats.detach().cpu().double())
    here = invert_rigid(viewmat.detach().cpu().double())
    turns = places[:, :3, :3].mT @ here[:3, :3]
    # |R - R'| = 2 sqrt(2) sin(a / 2): no digits are lost where a is small, as they are by arccos
    chords = (turns - torch.eye(3, dtype=torch.float64)).flatten(1).norm(dim=1)
    angles = 2 * (chords / 8**0.5).clamp(max=1).arcsin()
    ways = (places[:, :3, 3] - here[:3, 3]).norm(dim=1) / median_distance(scene)
    squares = angles**2 + ways**2
    weights = 1 / (squares + HERE**2)
    return weights / (weights.sum() + 1 / FAR**2)


def median_distance(scene: Scene) -> float:
    """Of some Gaussians from the first photo's place; 1 where there is none."""
    means = scene.gaussians.means
    some = means[:: max(1, len(means) // _SAMPLES)].detach().cpu().double()
    centre = invert_rigid(scene.viewmats[0].detach().cpu().double())[:3, 3]
    distances = (some - centre).norm(dim=-1)
    middle = float(distances[torch.isfinite(distances)].median()) if len(distances) else 0.0
    return middle if middle > 0 else 1.0
