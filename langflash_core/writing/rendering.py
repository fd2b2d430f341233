"""Pictures of a scene in a program or a notebook, by OpenGL where there is some."""

from contextlib import AbstractContextManager
from pathlib import Path

import torch

from langflash_core.__main__ import in_program
from langflash_core.export import open_scene
from langflash_core.pipeline import seen_from
from langflash_core.types import Camera, Frame, Scene
from langflash_core.writing.cameras import kept_size
from langflash_core.writing.renderers import Renderer


def render(
    scene: Scene | Path | str,
    *,
    view: int = 0,
    camera: Camera | None = None,
    size: tuple[int, int] | None = None,
    render: Renderer | None = None,
) -> Frame:
    """One view of a scene: colours (H, W, 3) in [0, 1], depths (H, W) in scene units. A notebook shows it.

    Args:
        scene: or the path of one.
        view: input photo whose camera is used, from 0; not asked for where `camera` is given.
        size: (width, height) in pixels; None: that of the photo as the scene keeps it, or the camera's own.
        render: who draws, as a `renderer()` that stays open; None: one that is opened for this picture.

    Raises:
        ViewError: there is no such view, or the size cannot be drawn.
        SceneFileError: the path holds no scene. InputError: neither a scene nor a path was given.
    """
    scene = open_scene(scene)
    if camera is None and size is None and 0 <= view < scene.num_views:
        size = kept_size(scene, view)
    chosen = seen_from(scene, view, camera, size)
    with torch.no_grad():
        if render is not None:
            return render(scene, chosen, weight_maps=False)
        with renderer() as draw:
            return draw(scene, chosen, weight_maps=False)


def renderer() -> AbstractContextManager[Renderer]:
    """Who draws, for the length of a `with`; `query` and `render` take it as `render`, and draw many pictures
    sooner. OpenGL where there is some, else the reference in torch, which a warning says.
    """
    return in_program("cli.renderers", "open_renderer", None)
