"""Files of a scene as a request asks for them: what `export`, batch, window and API all go through.

Idea: the record of the request's kind (`outputs.py`) names its writer, which gets a `Job`: the scene, the
request, and who draws. Everything that can be said without the scene is said before it is read.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from langflash_core.base.files import check_folder, check_output_file, check_same_kind
from langflash_core.base.formats import kind_of
from langflash_core.base.outputs import ALL_OUT, PLY, SCENE, Output, import_reference
from langflash_core.base.records import told_shift
from langflash_core.base.request import ExportRequest
from langflash_core.base.running import Progress
from langflash_core.export import open_scene
from langflash_core.types import Scene
from langflash_core.writing.cameras import CameraChoice, chosen_camera
from langflash_core.writing.films import check_encoder
from langflash_core.writing.job import Job, no_progress
from langflash_core.writing.renderers import Renderer, torch_renderer

__all__ = ["Job", "Renderer", "prepare_output", "request_of_whole", "write"]


def prepare_output(request: ExportRequest) -> tuple[Output, CameraChoice]:
    """What is written and from where it is seen, checked as far as it can be without the scene.

    Raises:
        LangFlashError: words that do not go together, a camera that cannot be used, a package that is
            missing, or a place that cannot be written.
    """
    if request.segmented:
        check_folder(request.output)
    else:
        inputs = [] if request.scene is None else [request.scene]
        check_output_file(request.output, ALL_OUT, inputs=inputs)
    kind = request.check()
    if kind.keys and kind_of(request.output).endswith(".json") and not request.replace:
        check_same_kind(request.output, kind.keys)
    choice = chosen_camera(request.view, request.camera, request.size, request.ortho)
    if kind.moves:
        check_encoder()
    return kind, choice


def write(
    scene: Scene | Path | str,
    request: ExportRequest,
    *,
    renderers: Callable[[], AbstractContextManager[Renderer]] = torch_renderer,
    progress: Progress = no_progress,
) -> str:
    """Write what is asked for, all of it or nothing.

    Args:
        scene: or the path of one.
        renderers: opens who draws, where something is drawn; the reference in torch by default.

    Returns:
        What was written, in words.

    Raises:
        LangFlashError: the request cannot be fulfilled, or nothing answers.
    """
    kind, choice = prepare_output(request)
    scene = open_scene(scene)
    said = import_reference(kind.writer)(Job(request, kind, scene, choice, renderers, progress))
    return said + _shift_note(scene, request, kind)


def _shift_note(scene: Scene, request: ExportRequest, kind: Output) -> str:
    """That a file's coordinates are the scene's, not those of the file far from 0 that it came from."""
    places = kind.subject in ("scene", "photos") or kind.word in ("boxes", "surface")
    kept = kind in (PLY, SCENE) and not request.upright
    if scene.record.shift is None or kept or not places:
        return ""
    return f"; its coordinates lack the {told_shift(scene.record.shift)} that was taken off"


def request_of_whole(path: Path, prompts: tuple[str, ...]) -> ExportRequest:
    """A file by its name alone: all of the scene, or of every photo's view what answers the phrases where
    it is a table or masks of them, or a page with them asked."""
    kind = ExportRequest(path).kind
    asked = prompts if kind.needs_phrases or kind.phrases == "show" else ()
    return ExportRequest(path, prompts=asked, all_views=kind.looks and kind.needs_phrases)
