"""A scene as a film: from photo to photo and back, or around what has no photos."""

import math
from pathlib import Path

import torch

from langflash_core.errors import InputError, LangFlashError
from langflash_core.running import Progress
from langflash_core.types import NO_LANGUAGE, Camera, Scene

from ..window.poses import Pose, blend, from_view, median_reach, orbit, to_camera
from .renderers import Renderer

RATE = 30  # pictures a second
SECONDS = 6.0
_SWAY = (math.radians(12), math.radians(4))  # yaw and pitch around a single photo: further out are holes


def check_encoder() -> None:
    """Raises:
    InputError: the optional package that writes videos is missing.
    """
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        raise InputError(
            "videos need the package imageio-ffmpeg, which is not installed; "
            "pip install 'langflash[video]' brings it"
        ) from None


def tour(scene: Scene, size: tuple[int, int], seconds: float) -> list[Camera]:
    """Cameras of a closed round, sides rounded down to even numbers of pixels as encoders want them."""
    width, height = (max(2, side // 2 * 2) for side in size)
    views = _poses(scene)
    count = max(1, round(RATE * seconds))
    poses = [_at(views, index / count, _turns(scene)) for index in range(count)]
    return [to_camera(pose, width, height) for pose in poses]


def write(
    path: Path,
    scene: Scene,
    cameras: list[Camera],
    renderer: Renderer,
    progress: Progress,
) -> None:
    """Draw every camera into an H.264 file.

    Raises:
        LangFlashError: the encoder stopped.
    """
    import imageio_ffmpeg

    from langflash_core.export.png import to_8bit

    size = (cameras[0].width, cameras[0].height)
    film = imageio_ffmpeg.write_frames(str(path), size, fps=RATE, quality=8, macro_block_size=2)
    try:
        film.send(None)
        for index, camera in enumerate(cameras):
            progress("drawing", index / len(cameras))
            film.send(to_8bit(renderer(scene, camera, weight_maps=False).rgb).tobytes())
    except OSError as error:
        raise LangFlashError(f"the video encoder stopped ({error}); try another --size") from error
    finally:
        film.close()


def _poses(scene: Scene) -> list[Pose]:
    means = scene.gaussians.means.double().cpu().numpy()
    pairs = zip(scene.viewmats.double().cpu().numpy(), scene.Ks.double().cpu().numpy(), strict=True)
    return [from_view(V, K, scene.view_size, median_reach(means, V, K, scene.view_size)) for V, K in pairs]


def _turns(scene: Scene) -> bool:
    """Whether the scene can be walked around: a splat file's that is looked at from outside."""
    at_origin = torch.equal(scene.viewmats[0].cpu(), torch.eye(4))
    return scene.semantics.space == NO_LANGUAGE and not at_origin


def _at(views: list[Pose], time: float, turns: bool) -> Pose:
    """The pose at `time` in [0, 1) of the round."""
    if len(views) == 1:
        angle = 2 * math.pi * time
        if turns:
            return orbit(views[0], angle, 0.0)
        return orbit(views[0], _SWAY[0] * math.sin(angle), _SWAY[1] * (1 - math.cos(angle)) / 2)
    leg, fraction = divmod(time * len(views), 1.0)
    return blend(views[int(leg)], views[(int(leg) + 1) % len(views)], fraction)
