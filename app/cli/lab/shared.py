"""What several actions of `eval` open in the same way."""

from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.base.files import readable_file
from langflash_core.errors import WeightsError
from langflash_core.lab.evaluation.bench import Render
from langflash_core.scene.exposure import lit_camera
from langflash_core.types import Camera, Frame, Scene
from langflash_core.writing.renderers import Renderer

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.lpips import Lpips


def opened_lpips(path: Path | None) -> "Lpips | None":
    """LPIPS as --lpips names it; None where it does not.

    Raises:
        WeightsError: it cannot be read, or holds something else.
    """
    from langflash_core.lab.evaluation.lpips import Lpips

    return None if path is None else Lpips(readable_file(path, "LPIPS file", WeightsError))


def colour_only(renderer: Renderer) -> Render:
    """A renderer without weight maps, in the light of the place, as people see it."""

    def render(scene: Scene, camera: Camera) -> Frame:
        return renderer(scene, lit_camera(scene, camera), weight_maps=False)

    return render
