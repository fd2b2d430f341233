"""A small room made by hand: three surfaces, three atoms, so that each phrase has one right place; and
states that show it."""

import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from app.window.asking.commands import EditPrompt
from app.window.commands import Command, apply
from app.window.scene.commands import SceneArrived
from app.window.scene.state import SceneInfo
from app.window.state import State
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History
from langflash_core.types import Gaussians, Record, Scene, Semantics

PHRASES = ("armchair", "wall", "floor")
COLOURS = ((0.75, 0.15, 0.12), (0.62, 0.66, 0.70), (0.45, 0.33, 0.22))
VIEW_SIZE = (224, 168)
CHAIR = (-0.15, 0.10, 0.85)  # its middle, left of and below the image's centre


def _sheet(corner, right, down, count) -> np.ndarray:
    steps = (np.arange(count) + 0.5) / count
    u, v = np.meshgrid(steps, steps)
    return np.array(corner) + u.reshape(-1, 1) * np.array(right) + v.reshape(-1, 1) * np.array(down)


def room(dictionary: torch.Tensor, space: str = "minilm") -> Scene:
    """A wall, a floor and a red block in front; `dictionary` (3, C) holds `PHRASES`."""
    x, y, z = CHAIR
    sheets = [
        _sheet((x - 0.2, y - 0.2, z - 0.2), (0.4, 0, 0), (0, 0.4, 0), 50),  # the block's front
        _sheet((-1.2, -0.8, 1.3), (2.4, 0, 0), (0, 1.2, 0), 70),  # the wall
        _sheet((-1.2, 0.4, 0.3), (2.4, 0, 0), (0, 0, 1.0), 70),  # the floor
    ]
    sizes = (0.4 / 50, 2.4 / 70, 2.4 / 70)
    means = torch.tensor(np.concatenate(sheets), dtype=torch.float32)
    ids = torch.cat([torch.full((len(s),), k) for k, s in enumerate(sheets)])
    # Checks of two shades: without texture an orbit around a flat wall would show no change.
    shade = 0.8 + 0.2 * ((means * 5).floor().sum(-1) % 2)
    colours = torch.tensor(COLOURS)[ids] * shade[:, None]
    scales = 0.6 * torch.tensor(sizes)[ids][:, None].expand(-1, 3).contiguous()
    count = len(means)
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1
    gaussians = Gaussians(means, quats, scales, torch.full((count,), 0.95), colour_to_sh(colours)[:, None])
    semantics = Semantics(ids[:, None], torch.ones(count, 1), dictionary, space)
    focal = 0.5 * VIEW_SIZE[0] / math.tan(math.radians(30))
    K = torch.tensor([[focal, 0, VIEW_SIZE[0] / 2], [0, focal, VIEW_SIZE[1] / 2], [0, 0, 1.0]])
    second = torch.eye(4)
    second[0, 3] = -0.3  # half a shoulder's width to the right
    viewmats = torch.stack((torch.eye(4), second))
    return Scene(
        gaussians,
        semantics,
        viewmats,
        K.expand(2, 3, 3).contiguous(),
        VIEW_SIZE,
        photos=(_jpeg((120, 90, 80)), _jpeg((80, 90, 120))),
        record=Record(preset="mini", warnings=("The photos overlap little; depth may be off.",)),
    )


def _jpeg(colour: tuple[int, int, int]) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", VIEW_SIZE, colour).save(stream, "JPEG")
    return stream.getvalue()


def after(state: State, *commands: Command) -> State:
    """The state after all of them."""
    for command in commands:
        state = apply(state, command)
    return state


def told(state: State) -> str:
    """The newest message."""
    return state.toasts[-1].text


def with_info(state: State, **changes) -> State:
    """The state with other facts of the scene on show."""
    assert state.scene.info is not None
    return state.with_scene(info=replace(state.scene.info, **changes))


def with_splats(state: State, **changes) -> State:
    """The state with other fields of the scene itself."""
    assert state.scene.info is not None
    return with_info(state, scene=replace(state.scene.info.scene, **changes))


def of_photos(state: State) -> State:
    """A scene that knows which photo made what: the first made all."""
    assert state.scene.info is not None
    count = len(state.scene.info.scene.gaussians)
    return with_splats(state, view_ids=torch.zeros(count, dtype=torch.int64))


VIEWS = (Pose(), Pose(Vector(0.3, 0.0, 0.0)))


def shown_scene(path: Path | None = Path("/rooms/my room.langflash")) -> State:
    """A state with a scene of two views and the phrase "door"."""
    scene = room(torch.eye(3))
    info = SceneInfo(
        serial=1, name="room", scene=scene, views=VIEWS, num_gaussians=len(scene.gaussians.means),
        num_atoms=3, space="minilm", path=path, extent=(Vector(-1.0, -1.0, 0.0), Vector(1.0, 1.0, 2.0)),
        history=History(first_marks(scene)),
    )  # fmt: skip
    return after(State(), SceneArrived(info), EditPrompt(0, "door"))


def labels(state: State) -> list[str]:
    """Of the edits that are done."""
    assert state.editing.history is not None
    return [entry.label for entry in state.editing.history.done]
