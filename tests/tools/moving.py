"""What a hand that drags in the window comes to see: black, or the inside of something.

    python -m tests.tools.moving [SCENE ...] [--places N] [--shots FOLDER]

Ten places of every scene, those of photos and some between; from each the left button drags 60, 100 and 200
pixels in eight directions, on the window's own picture with its own commands and effects, in a window of
1280 x 800. Without a scene, on a room made here. A row a length of drag, at photos' places and between:

    unseen    share of the picture where no surface is (alpha below .5), mean over places and directions
    black     the same of the picture as the window shows it, which fills what is beside surfaces and fades:
              share that is darker than half were all surfaces white; at 0 pixels it is what is beside the
              photos from the start, as beside upright ones in this wide window
    added     of that, what the drag brought
    lost      share of drags after which half of the picture is black that was not before
    inside    share of drags after which a surface of a layer that the picture shows is nearer than a tenth of
              the scene's depth, or such surfaces cover a fifth of the picture; layers of photos far away are
              not drawn
    turned    degrees, mean;  moved: of the scene's depth, mean
"""

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import moderngl
import numpy as np
import torch
from imgui_bundle import ImVec2, imgui
from PIL import Image
from scipy.spatial import KDTree

import langflash_core as lf
from app.gl import moving_renderer
from app.gl.scene import Thinned
from app.window.commands import Command, Tick, apply
from app.window.editing.effects import EditingEffects
from app.window.effects import Hands
from app.window.frame import canvas
from app.window.kit.look import Look
from app.window.kit.textures import Thumbnails
from app.window.scene import camera
from app.window.scene.commands import SceneArrived
from app.window.scene.effects import SceneEffects
from app.window.scene.state import FLIGHT_SECONDS
from app.window.scene.work import describe_scene
from app.window.state import State
from app.window.viewport import Viewport
from langflash_core.base.graphics import offscreen_context
from langflash_core.geometry import poses
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.nearness import Nearness
from langflash_core.geometry.poses import Pose
from langflash_core.scene.thin import thin_with_rows
from langflash_core.types import Scene
from tests.app.window.headless import context
from tests.boxroom import box_room, in_layers

WINDOW = (1280, 800)
JUDGED = (320, 200)  # pixels of the pictures that are judged
DRAGS = (60, 100, 200)
STEP = 10  # pixels a frame
DIRECTIONS = 8
PLACES = 10
NEAR = 0.1  # of the scene's depth
COVERED = 0.2  # of the picture
SHOWN = 0.5  # alpha
LOST = 0.5  # of the picture, black


@dataclass(frozen=True)
class Seen:
    """unseen, black: shares of the picture. inside: whether it is inside something."""

    unseen: float
    black: float
    inside: bool


@dataclass(frozen=True)
class Drag:
    """One drag of so many pixels, at a photo's place or between; before and after it, degrees turned, way in
    the scene's depths."""

    at_photo: bool
    pixels: int
    before: Seen
    after: Seen
    turned: float
    moved: float


class Window:
    """The window's picture, commands and effects for one scene, without a display."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        self.state = State()
        self.state = replace(
            self.state, preferences=replace(self.state.preferences, photos_in_space=False, floor_grid=False)
        )
        self.viewport = Viewport(ctx)
        hands = Hands(self.perform, self.perform, lambda work: None, lambda: None, lambda: self.state.now)
        drawn = SceneEffects(hands, self.viewport, Thumbnails(ctx), lambda title: None)
        self._effects = (drawn, EditingEffects(hands, self.viewport))
        self.perform(SceneArrived(describe_scene(scene, 1, "walk")))
        for share in self.viewport.shares:  # the window's worker does so
            self.viewport.thin(scene, share, Thinned(*thin_with_rows(scene, share)))

    def perform(self, command: Command) -> None:
        before, self.state = self.state, apply(self.state, command)
        for effects in self._effects:
            effects.follow(command, before, self.state)

    def stand(self, place: Pose | int) -> None:
        """At a photo's place, or between; its picture is drawn."""
        self.perform(camera.MoveTo(place) if isinstance(place, Pose) else camera.JumpTo(place))
        self.perform(Tick(self.state.now + FLIGHT_SECONDS + 1))
        shown = lambda: self.viewport.texture is not None and self.viewport.drawn  # noqa: E731
        while getattr(shown(), "pose", None) != self.state.scene.pose:
            self.viewport.update(self.state, WINDOW, self.state.now)

    def drag(self, across: float, along: float, frames: int) -> Iterator[Pose]:
        """The poses after each frame of a drag from the picture's middle, by so many pixels a frame."""
        io, (x, y) = imgui.get_io(), (WINDOW[0] / 2, WINDOW[1] / 2)
        io.add_mouse_pos_event(x, y)
        self._frame(3)
        io.add_mouse_button_event(0, True)
        self._frame(2)
        for step in range(1, frames + 1):
            io.add_mouse_pos_event(x + step * across, y + step * along)
            self._frame()
            yield self.state.scene.pose
        io.add_mouse_button_event(0, False)
        self._frame(2)

    def _frame(self, count: int = 1) -> None:
        for _ in range(count):
            imgui.new_frame()
            imgui.set_next_window_pos(ImVec2(0, 0))
            imgui.set_next_window_size(ImVec2(*WINDOW))
            imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
            imgui.begin("##picture", None, imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move)
            issued = canvas.draw(self.state, Look(1.0, self.viewport.texture, None))  # pyright: ignore[reportArgumentType]
            imgui.end()
            imgui.pop_style_var()
            imgui.end_frame()
            for command in issued:
                self.perform(command)
            for effects in self._effects:
                effects.after_picture(self.state)


class Judge:
    """Says what is seen from a pose."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, depth: float) -> None:
        self._renderer, self._white = moving_renderer(ctx), moving_renderer(ctx)
        self._renderer.set_scene(scene)
        self._white.set_scene(whitened(scene))
        self._layers = Nearness.of(scene) if scene.layered else None
        views = (None,) if self._layers is None else self._layers.views
        self._surfaces = {view: surfaces(scene if view is None else scene.layer(view)) for view in views}
        self._near = NEAR * depth

    def seen(self, pose: Pose) -> Seen:
        camera = poses.to_camera(pose, *JUDGED)
        white = self._white.colours(camera, fade=True, fill=True)
        self._white.draw(camera, weight_maps=False)
        frame = self._white.frame()
        shown = frame.alphas >= SHOWN
        covered = (shown & (frame.depths < self._near)).double().mean().item()
        black = float((white.max(2) < SHOWN * 255).mean())
        inside = covered > COVERED or self._nearest(pose) < self._near
        return Seen(1 - shown.double().mean().item(), black, inside)

    def _nearest(self, pose: Pose) -> float:
        """Distance of the nearest surface, of those layers that the picture shows."""
        place = np.array(pose.centre)
        views = (None,) if self._layers is None else self._layers.seen(place, pose.axes[:, 2]).views
        return min(float(self._surfaces[view].query(place)[0]) for view in views)

    def keep(self, pose: Pose, folder: Path | None, name: str) -> None:
        """The picture from a pose as the window shows it, in a folder, if there is one."""
        if folder is not None:
            camera = poses.to_camera(pose, WINDOW[0] // 2, WINDOW[1] // 2)
            picture = self._renderer.colours(camera, fade=True, fill=True)
            Image.fromarray(picture).save(folder / f"{name}.png")


def surfaces(scene: Scene) -> KDTree:
    """Places of what is solid."""
    gaussians = scene.gaussians
    return KDTree(gaussians.means[gaussians.opacities > SHOWN].double().numpy())


def whitened(scene: Scene) -> Scene:
    """The scene with all surfaces white."""
    sh = colour_to_sh(torch.ones_like(scene.gaussians.sh[:, :1]))
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh))


def places(views: Sequence[Pose], most: int) -> list[Pose | int]:
    """Half of them photos' places, the others between neighbours: a quarter of the way from a photo at the
    least, where a drag is another one than at its own place."""
    count = len(views)
    chosen = np.unique(np.linspace(0, count - 1, min(count, most // 2)).round().astype(int))
    some: list[Pose | int] = list(chosen.tolist())
    for at in np.linspace(0, count - 1, most - len(some) + 2)[1:-1]:
        first = min(int(at), count - 2)
        some.append(poses.blend(views[first], views[first + 1], min(max(at - first, 0.25), 0.75)))
    return some


def walked(ctx: moderngl.Context, scene: Scene, shots: Path | None = None, most: int = PLACES) -> list[Drag]:
    """All drags of one scene; pictures of those to the left, in a folder."""
    window = Window(ctx, scene)
    assert window.state.scene.info is not None
    views = window.state.scene.info.views
    depth = float(np.median([view.reach for view in views]))
    judge, drags = Judge(ctx, scene, depth), list[Drag]()
    for number, place in enumerate(places(views, most)):
        window.stand(place)
        before = judge.seen(window.state.scene.pose)
        judge.keep(window.state.scene.pose, shots, f"place{number}")
        for way in range(DIRECTIONS):
            window.stand(place)
            start, angle = window.state.scene.pose, math.tau * way / DIRECTIONS
            steps = STEP * math.cos(angle), STEP * math.sin(angle)
            for frame, pose in enumerate(window.drag(*steps, DRAGS[-1] // STEP), start=1):
                if frame * STEP not in DRAGS:
                    continue
                at = isinstance(place, int), frame * STEP
                drags.append(_judged(at, before, start, pose, judge, depth))
                if way == DIRECTIONS // 2:
                    judge.keep(pose, shots, f"place{number}_left{frame * STEP}")
    window.viewport.release()
    return drags


def _judged(at: tuple[bool, int], before: Seen, start: Pose, end: Pose, judge: Judge, depth: float) -> Drag:
    cosine = (float(np.trace(start.axes.T @ end.axes)) - 1) / 2
    degrees = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
    moved = math.dist(start.centre, end.centre) / depth
    return Drag(*at, before, judge.seen(end), degrees, moved)


def table(name: str, drags: Sequence[Drag]) -> Iterator[str]:
    """Rows of one scene: as it stands, and after each length of drag."""
    stood = [replace(drag, pixels=0, after=drag.before, turned=0.0, moved=0.0) for drag in drags]
    for at_photo in (True, False):
        for pixels in (0, *DRAGS):
            some = [drag for drag in (*stood, *drags) if (drag.at_photo, drag.pixels) == (at_photo, pixels)]
            lost = float(np.mean([drag.before.black <= LOST < drag.after.black for drag in some]))
            added = float(np.mean([drag.after.black - drag.before.black for drag in some]))
            unseen, black, inside, turned, moved = (
                float(np.mean(numbers))
                for numbers in zip(*((*vars(d.after).values(), d.turned, d.moved) for d in some), strict=True)
            )
            where = "photos" if at_photo else "between"
            yield (
                f"| {name} | {where} | {pixels} | {unseen:.1%} | {black:.1%} | {added:+.1%} | {lost:.1%} "
                f"| {inside:.1%} | {turned:.1f} | {moved:.3f} |"
            )


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser("moving", description=__doc__)
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE")
    parser.add_argument("--shots", type=Path, help="a folder for pictures")
    parser.add_argument("--places", type=int, default=PLACES, help="of every scene, from which to drag")
    asked = parser.parse_args(arguments)
    scenes = {path.stem: path for path in asked.scenes} or {"a room made here": None}
    ctx = offscreen_context()
    head = "| scene | at | pixels | unseen | black | added | lost | inside | turned | moved |"
    sys.stdout.write(f"{head}\n|{'---|' * 10}\n")
    for name, path in scenes.items():
        shots = None if asked.shots is None else asked.shots / name
        if shots is not None:
            shots.mkdir(parents=True, exist_ok=True)
        scene = in_layers(box_room(), 1.0) if path is None else lf.load(path)
        with context(WINDOW):
            sys.stdout.write("\n".join(table(name, walked(ctx, scene, shots, asked.places))) + "\n")
        sys.stdout.flush()
    ctx.release()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
