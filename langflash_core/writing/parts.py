"""Single files of what a scene taken apart holds: cut-outs, soft masks, instances, surfaces."""

from pathlib import Path

from langflash_core.base.files import make_folder, staged_folder
from langflash_core.base.outputs import INSTANCES, SOFT, Output
from langflash_core.errors import PromptError
from langflash_core.export import glb
from langflash_core.export.paint import write_picture
from langflash_core.export.png import write_grey, write_labels
from langflash_core.types import SegmentedView
from langflash_core.writing.job import Job
from langflash_core.writing.subject import Subject, cut_out, plural, surfaces, taken_apart, views_of


def write_parts(job: Job) -> str:
    """A cut-out, a soft mask or an instance map of all phrases together, a picture a camera.

    Raises:
        LangFlashError: nothing answers, or a picture cannot be written.
    """
    cameras = job.cameras()
    targets = job.targets(cameras)
    with job.renderer() as renderer:
        numbers = [None] * len(cameras)
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, cameras, numbers, renderer)
        with staged_folder(job.request.output.parent) as staging:
            seen = False
            for index, view in enumerate(views_of(subject)):
                job.progress("drawing", index / len(cameras))
                _write_part(job.kind, staging / targets[index].name, subject, view)
                seen = seen or bool((view.union >= 0.5).any())
            if not seen:
                where = "this view" if len(cameras) == 1 else "any view"
                raise PromptError(f"not found in {where}: {', '.join(job.prompts)}; choose another --view")
    size = f"{cameras[0].width} x {cameras[0].height}"
    return f"{size}, {plural(len(subject.things), 'instance')} of {plural(len(subject.found), 'phrase')}"


def _write_part(kind: Output, path: Path, subject: Subject, view: SegmentedView) -> None:
    if kind is INSTANCES:
        write_labels(path, view.things, subject.things)
    elif kind is SOFT:
        write_grey(path, view.union, 0.0, 1.0)
    else:
        write_picture(path, cut_out(subject, view, None))


def write_surface(job: Job) -> str:
    """A mesh per phrase, seen from the photos' views.

    Raises:
        LangFlashError: nothing answers, scikit-image is missing, or the file cannot be written.
    """
    output = job.request.output
    with job.renderer() as renderer:
        job.progress("drawing", 0.2)
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, (), (), renderer)
        meshes = surfaces(subject)
    make_folder(output.parent)
    glb.write_surfaces(meshes, output, subject.metres or 1.0)
    faces = sum(len(mesh.faces) for _, mesh in meshes)
    return f"{plural(len(meshes), 'surface')}, {faces:,} triangles"
