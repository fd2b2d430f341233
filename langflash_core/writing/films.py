"""A scene as a film: from photo to photo, around it, along its tour or key frames; in colours or as a
heat-map."""

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core import pipeline
from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import readable_file, staged_folder
from langflash_core.base.limits import TEXT
from langflash_core.base.running import Progress
from langflash_core.errors import InputError, ViewError
from langflash_core.export.png import USUAL, heat_over, to_8bit
from langflash_core.geometry.poses import (
    UP,
    Pose,
    Vector,
    alike,
    blend,
    framing,
    from_view,
    on_tour,
    orbit,
    to_camera,
    tour_seconds,
)
from langflash_core.geometry.reach import median_reach
from langflash_core.geometry.rotations import turn_of
from langflash_core.geometry.tours import RATE, along, even
from langflash_core.language.answers import lit_from, presence_scores
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.scene.exposure import lit_camera
from langflash_core.scene.tour import read_tour
from langflash_core.types import NO_LANGUAGE, Camera, Frame, Scene
from langflash_core.writing.cameras import camera_of, kept_size
from langflash_core.writing.encoding import open_encoder
from langflash_core.writing.job import Job
from langflash_core.writing.renderers import Renderer
from langflash_core.writing.settings import FILMING


def check_encoder() -> None:
    """Raises InputError: the optional package that writes videos is missing."""
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        raise InputError(
            "videos need the package imageio-ffmpeg, which is not installed; "
            "pip install 'langflash[video]' brings it"
        ) from None


def write_film(job: Job) -> str:
    """The scene, or what of it answers, or with one phrase's heat-map, along a way.

    Raises:
        LangFlashError: nothing answers, the key frames cannot be used, or the encoder stopped.
    """
    request, scene = job.request, job.scene
    shown, heat = scene, None
    if job.kind.colours:
        heat = compile_phrase(scene, job.prompts[0], request.threshold)
    elif job.prompts:
        shown = pipeline.select(scene, job.prompts, threshold=request.threshold)
    cameras = way(request.path, scene, shown, request.size, request.seconds)
    with job.renderer() as renderer, staged_folder(request.output.parent) as staging:
        heat = heat and heat.steady(shown, cameras, renderer)
        write(staging / request.output.name, shown, cameras, renderer, job.progress, heat, job.colours)
    return f"{len(cameras) / RATE:.1f} s, {cameras[0].width} x {cameras[0].height}"


@dataclass(frozen=True)
class Heat:
    """What a heat-map is of. threshold: that somebody chose, or None."""

    compiled: CompiledQuery
    threshold: float | None

    def lit_from(self, frame: Frame, relevance: Float[Tensor, "1 H W"]) -> float:
        """The relevancy from which pixels of this picture belong to its answer."""
        return lit_from(_scores(frame, relevance), self.compiled, self.threshold)[0]

    def steady(self, scene: Scene, cameras: Sequence[Camera], renderer: Renderer) -> "Heat":
        """Lit from the same relevancy in all frames, as the surest of some is: a score beside the threshold
        would flicker."""
        asked = cameras[:: max(1, len(cameras) // FILMING.asked)]
        scores = torch.cat([_scores(*renderer.answered(scene, each, self.compiled)) for each in asked])
        return replace(
            self, threshold=lit_from(scores.amax(0, keepdim=True), self.compiled, self.threshold)[0]
        )


def _scores(frame: Frame, relevance: Float[Tensor, "P H W"]) -> Float[Tensor, " P"]:
    return presence_scores(relevance, frame.alphas >= ANSWERING.covered_alpha)


def compile_phrase(scene: Scene, phrase: str, threshold: float | None) -> Heat:
    """Of the head of a phrase (`language/grammar.py`).

    Raises:
        PromptError: the phrase cannot be used.
    """
    return Heat(compile_spoken(scene, language_space(scene.semantics.space), [phrase]), threshold)


def way(
    path: str | None, scene: Scene, shown: Scene, size: tuple[int, int] | None, seconds: float | None
) -> list[Camera]:
    """Cameras of a film, sides rounded down to even numbers of pixels as encoders want them.

    Args:
        path: photos (None), orbit, tour, or a file of key frames. shown: the part of the scene that is drawn.
        size: None: that of the first photo that the scene keeps, or of the key frames.

    Raises:
        ViewError: the key frames cannot be used, or the scene has no tour.
    """
    if path == "tour":
        stops, size = read_tour(scene.record.tour).stops, even(size or kept_size(scene, 0))
        if not stops:
            raise ViewError(
                'the scene has no tour; give it stops with: langflash tour stop SCENE "The window"'
            )
        return [to_camera(pose, *size) for pose in along_stops([stop.pose for stop in stops], seconds)]
    if path in (None, "photos", "orbit"):
        width, height = even(size or kept_size(scene, 0))
        views = _poses(scene)
        around = _turn(views[0], shown) if path == "orbit" else None
        count = max(1, round(RATE * (seconds or FILMING.seconds)))
        # A splat file's that is looked at from outside can be walked around.
        at_origin = torch.equal(scene.viewmats[0].cpu(), torch.eye(4))
        turns, up = scene.semantics.space == NO_LANGUAGE and not at_origin, _up(scene)

        def pose(index: int) -> Pose:
            angle = 2 * math.pi * index / count
            return orbit(around, angle, 0.0, up) if around else _at(views, index / count, turns, up)

        return [to_camera(pose(index), width, height) for index in range(count)]
    return along(*read_key_frames(Path(path), seconds), size)


def along_stops(stops: Sequence[Pose], seconds: float | None) -> list[Pose]:
    """Poses of a film of a tour.

    Args:
        seconds: of all of it; None: as long as in the window.
    """
    whole = tour_seconds(len(stops))
    seconds = whole if seconds is None else seconds
    stops, count = alike(stops), max(1, round(RATE * seconds))
    return [on_tour(stops, index / RATE * whole / seconds) for index in range(count)]


def write(
    path: Path,
    scene: Scene,
    cameras: list[Camera],
    renderer: Renderer,
    progress: Progress,
    heat: Heat | None = None,
    colours: HeatColours = USUAL,
) -> None:
    """Draw every camera into an H.264 file, or an animated WebP that begins again at its end.

    Args:
        heat: over the colours; None: colours alone. colours: of the heat-map.

    Raises:
        LangFlashError: the disk is full, or the encoder stopped otherwise.
    """
    size = (cameras[0].width, cameras[0].height)
    with open_encoder(path, size) as add:
        for index, camera in enumerate(cameras):
            progress("drawing", index / len(cameras))
            add(picture(scene, camera, renderer, heat, colours).tobytes())


def picture(
    scene: Scene,
    camera: Camera,
    renderer: Renderer,
    heat: Heat | None,
    colours: HeatColours = USUAL,
) -> np.ndarray:
    """(H, W, 3) uint8, in the light of the place."""
    camera = lit_camera(scene, camera)
    if heat is None:
        return renderer.colours(scene, camera)
    frame, relevance = renderer.answered(scene, camera, heat.compiled)
    lit = heat_over(relevance[0], frame.rgb, heat.lit_from(frame, relevance), heat.compiled.mode, colours)
    return to_8bit(lit)


def _poses(scene: Scene) -> list[Pose]:
    means = scene.gaussians.means.double().cpu().numpy()
    pairs = zip(scene.viewmats.double().cpu().numpy(), scene.Ks.double().cpu().numpy(), strict=True)
    return [from_view(V, K, scene.view_size, median_reach(means, V, K, scene.view_size)) for V, K in pairs]


def _turn(view: Pose, shown: Scene) -> Pose:
    """Where an orbit begins: as the first view looks, far enough away to show all that is drawn."""
    means = shown.gaussians.means.detach().double().cpu().numpy()
    low, high = np.quantile(means[np.isfinite(means).all(1)], FILMING.middle, axis=0)
    return framing(view, Vector(*low.tolist()), Vector(*high.tolist()))


def _up(scene: Scene) -> Float[np.ndarray, "3"]:
    """Of the world that the scene stands in; of the first camera where nobody looked."""
    return UP if scene.record.world is None else -turn_of(scene.record.world)[1]


def _at(views: list[Pose], time: float, turns: bool, up: Float[np.ndarray, "3"]) -> Pose:
    """The pose at `time` in [0, 1) of the round."""
    if len(views) == 1:
        angle = 2 * math.pi * time
        sway = FILMING.sway[0] * math.sin(angle), FILMING.sway[1] * (1 - math.cos(angle)) / 2
        return orbit(views[0], *((angle, 0.0) if turns else sway), up)
    leg, fraction = divmod(time * len(views), 1.0)
    return blend(views[int(leg)], views[(int(leg) + 1) % len(views)], fraction)


def read_key_frames(path: Path, seconds: float | None) -> tuple[list[Camera], list[float]]:
    """Cameras and their times in seconds, from 0: as the file says, or evenly spread over `seconds`.

    Raises:
        ViewError: missing, not a list of two or more cameras, or times that do not rise.
    """
    readable_file(path, "key frames", ViewError)
    TEXT.check(path.stat().st_size, path.name, ViewError)
    try:
        entries = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        entries = None
    if not isinstance(entries, list) or len(entries) < 2:
        raise ViewError(f"{path} holds no key frames: expected a JSON list of two or more cameras")
    cameras = [camera_of(entry, f"{path}, key frame {number}") for number, entry in enumerate(entries)]
    if len({camera.orthographic for camera in cameras}) > 1:
        raise ViewError(f"{path}: either all key frames are orthographic, or none")
    times = [entry.get("time") for entry in entries]
    if all(time is None for time in times):
        return cameras, np.linspace(0, seconds or FILMING.seconds, len(cameras)).tolist()
    numbers = [t for t in times if type(t) in (int, float) and math.isfinite(t)]
    rising = len(numbers) == len(times) and all(a < b for a, b in itertools.pairwise(numbers))
    if not rising or numbers[-1] - numbers[0] > FILMING.longest:
        longest = f"over at most {FILMING.longest:g} seconds"
        raise ViewError(f"{path}: times must rise, all of them given, {longest}")
    if seconds is not None:
        raise ViewError(f"{path} says its times; leave --seconds out")
    return cameras, [number - numbers[0] for number in numbers]
