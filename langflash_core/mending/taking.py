"""What goes with a part that is taken out, which views tell most of it, and how parts are drawn there.

A part's *fringe* goes with it: what a photo shows within a margin of the part has its colours, and what that
photo's layer has behind it nobody saw. So does what other layers have in its place, as deep as it is there:
they show the same thing. What stands before the part stays. So what goes is known without drawing more than
the part itself.

Sizes: N Gaussians, V views, H W pixels of a view.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.nearness import Nearness
from langflash_core.mending.settings import TAKING
from langflash_core.rig.projected import Projected, project_points
from langflash_core.splat.compose import blend_layers
from langflash_core.splat.frustum import may_touch
from langflash_core.types import Camera, Frame, Scene

from .looks import Render
from .photos import nearest_in, reaches


@dataclass(frozen=True)
class Nearby:
    """A scene of which few Gaussians are drawn at a time, blended of the layers that the whole one shows.
    near: None: it has no layers."""

    scene: Scene
    near: Nearness | None

    @staticmethod
    def of(scene: Scene) -> "Nearby":
        return Nearby(scene, Nearness.of(scene) if scene.layered else None)

    def drawn(self, some: Tensor, camera: Camera, render: Render, *, weight_maps: bool = True) -> Frame:
        """A picture of some of the Gaussians, (N,) bool."""
        rows = np.flatnonzero(some.cpu().numpy())
        whole = self.scene.gaussians
        touching = torch.from_numpy(rows[may_touch(whole.rows(torch.from_numpy(rows)), camera)])
        ids = self.scene.view_ids
        if self.near is None or ids is None or not self.near.views:
            return render(self.scene.rows(touching), camera, weight_maps=weight_maps)
        chosen, own = self.near.chosen(camera), ids[touching]
        flat = self.scene.with_record(layered=False)
        frames = [
            render(flat.rows(touching[(own == view) | (own < 0)]), camera, weight_maps=weight_maps)
            for view in chosen.views
        ]
        return blend_layers(frames, chosen.weights)


def with_fringe(scene: Scene, members: Tensor, render: Render) -> Tensor:
    """(N,) bool: a part (N,) bool, and what has to go with it."""
    gone, own = members.clone(), scene.view_ids if scene.layered else None
    around = _around(scene, members)
    for view in _counts(scene, members).nonzero()[:, 0].tolist():
        camera, layer = scene.camera(view), None if own is None else own == view
        shown = members if own is None or layer is None else members & (layer | (own < 0))
        part = scene.rows(shown.nonzero()[:, 0]).with_record(layered=False)
        frame = render(part, camera, weight_maps=False)
        mask = (frame.alphas >= TAKING.shown).cpu().numpy()
        if not mask.any():
            continue
        margins = torch.from_numpy(reaches(mask)).flatten()
        depths = torch.from_numpy(nearest_in(frame.depths.cpu().numpy(), mask)).double().flatten()
        for rows, margin in ((around, 0.0 if own is not None else TAKING.margin), (layer, TAKING.margin)):
            if rows is None:
                continue
            places = (rows & ~gone).nonzero()[:, 0]
            there = _seen(scene, places, camera)
            apart = there.z / there.looked_up(depths)
            found = there.inside & (there.looked_up(margins) <= margin) & (apart >= 1 / TAKING.beside)
            gone[places[found if rows is layer else found & (apart <= TAKING.beside)]] = True
    return gone


def _seen(scene: Scene, places: Tensor, camera: Camera) -> Projected:
    """Where some Gaussians lie in a picture."""
    means, size = scene.gaussians.means[places].double().T, (camera.height, camera.width)
    return project_points(means, camera.viewmat.double(), camera.K.double(), size)


def _around(scene: Scene, members: Tensor) -> Tensor:
    """(N,) bool: what lies in the box around a part, but for the few that are far from the rest of it."""
    means = scene.gaussians.means
    own = np.quantile(means[members].numpy(), (TAKING.far, 1 - TAKING.far), axis=0)
    low, high = torch.from_numpy(own).to(means)
    room = TAKING.room * (high - low).norm()
    return ((means >= low - room) & (means <= high + room)).all(1)


def most_telling(scene: Scene, part: Tensor, most: int) -> list[int]:
    """At most so many of the views that show a part (N,) bool, first the one that shows most of it, then each
    time one that shows much of it from far beside those before."""
    counts = _counts(scene, part).double()
    eyes = invert_rigid(scene.viewmats.cpu().double())[:, :3, 3]
    far, chosen = torch.ones_like(counts), []
    while len(chosen) < most and float((counts * far).max()) > 0:
        chosen.append(int((counts * far).argmax()))
        far = torch.cdist(eyes, eyes[chosen]).amin(1)
    return chosen


def _counts(scene: Scene, part: Tensor) -> Tensor:
    """(V,) how many Gaussians of a part each view has in its picture: of a scene of layers, of its own and of
    what is in all."""
    rows = part.nonzero()[:, 0]
    means, (width, height) = scene.gaussians.means[rows].T, scene.view_size
    own = None if scene.view_ids is None or not scene.layered else scene.view_ids[rows]
    found = torch.zeros(scene.num_views, dtype=torch.int64)
    for view in range(scene.num_views):
        there = project_points(means, scene.viewmats[view], scene.Ks[view], (height, width)).inside
        found[view] = (there if own is None else there & ((own == view) | (own < 0))).sum()
    return found
