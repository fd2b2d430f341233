"""Files of Gaussians and of photos with their poses, and web pages."""

from pathlib import Path

from torch import Tensor

from langflash_core import pipeline
from langflash_core.base.files import make_folder
from langflash_core.base.formats import SOG_FOLDER, kind_of
from langflash_core.base.outputs import GLB, OPEN_USD, PLY, SCENE, SPLAT, import_reference
from langflash_core.errors import InputError
from langflash_core.export import read
from langflash_core.export.language import side_car
from langflash_core.export.sog import sog_files
from langflash_core.level import upright
from langflash_core.scene.thin import coarse_level
from langflash_core.surface.fused import fuse_layers
from langflash_core.types import Scene
from langflash_core.writing.job import Job


def write_scene(job: Job) -> str:
    """The scene, or what of it answers, in the format of the record.

    Raises:
        LangFlashError: nothing answers, or a file cannot be written.
    """
    scene, path = job.scene, job.request.output
    chosen = _as_fine(job)
    if job.kind is not SCENE and job.kind.subject != "photos":
        chosen = fuse_layers(chosen)
    if job.prompts:
        chosen = pipeline.select(chosen, job.prompts, threshold=job.request.threshold)
    chosen = upright(chosen) if job.request.upright else chosen
    make_folder(path.parent)
    axes = job.request.axes_of(path)
    import_reference(job.kind.of_scene)(chosen, path, **({"axes": axes} if axes else {}))
    if job.kind.subject == "photos":
        return f"{scene.num_views} photos in images/ and their poses"
    fewer = len(chosen.gaussians) < len(scene.gaussians)
    share = f" of {len(scene.gaussians):,}" if fewer or job.prompts else ""
    has_side_car = job.kind is PLY and chosen.semantics.num_atoms > 0
    marked = (
        f"; a {kind_of(path)} cannot say that they are to be smoothed" if _is_unmarked(job, chosen) else ""
    )
    beside = f", its language in {side_car(path).name}" if has_side_car else ""
    return f"{len(chosen.gaussians):,}{share} Gaussians, {_megabytes(path):.1f} MB{beside}{marked}"


def write_page(job: Job) -> str:
    """A web page with the whole scene; the phrases are what it shows as asked.

    Raises:
        LangFlashError: a phrase cannot be used, or the file cannot be written.
    """
    request, shown = job.request, pipeline.page_layers(_as_fine(job))
    beside = _beside(job)
    job.progress("reading the vocabulary", 0.2)
    make_folder(request.output.parent)
    phrases = pipeline.web_page(
        shown,
        request.output,
        job.prompts,
        threshold=request.threshold,
        with_text=request.with_text,
        title=(request.scene or request.output).stem,
        beside=beside,
    )
    known = "any phrase" if request.with_text else f"{len(phrases.texts)} phrases" if phrases else ""
    answers = f", answers {known}" if known else ""
    share = f" of {len(job.scene.gaussians):,}" if shown is not job.scene else ""
    more = f" and {len(beside)} scenes more" if beside else ""
    held = f"{len(shown.gaussians):,}{share} Gaussians{_layers(shown, job.scene)}{more}"
    return f"{held}, {_megabytes(request.output):.1f} MB{answers}"


def _layers(shown: Scene, whole: Scene) -> str:
    """How many layers a page holds, of a scene that has some."""
    if not shown.layered:
        return ""
    held, all_layers = (len(_of_photos(scene)) for scene in (shown, whole))
    return f" in {held} layers" if held == all_layers else f" in {held} of {all_layers} layers"


def _of_photos(scene: Scene) -> Tensor:
    """The photos that have a layer."""
    assert scene.view_ids is not None
    return scene.view_ids[scene.view_ids >= 0].unique()


def _beside(job: Job) -> dict[str, Scene]:
    """Other scenes of a page by their names, each as fine as the first."""
    scenes: dict[str, Scene] = {}
    own = (job.request.scene or job.request.output).stem
    for path in job.request.beside:
        if path.stem in scenes or path.stem == own:
            raise InputError(
                f"two scenes are called {path.stem}; rename one, so that the page tells them apart"
            )
        scenes[path.stem] = _as_fine(job, read(path, axes=job.request.axes_of(path)))
    return scenes


def _as_fine(job: Job, scene: Scene | None = None) -> Scene:
    scene = job.scene if scene is None else scene
    return coarse_level(scene) if job.request.detail == "low" else scene


def _is_unmarked(job: Job, scene: Scene) -> bool:
    return scene.record.antialiased and job.kind in (SPLAT, GLB, OPEN_USD)


def _megabytes(path: Path) -> float:
    files = sog_files(path) if kind_of(path) == SOG_FOLDER else [path]
    return sum(file.stat().st_size for file in files) / 1e6
