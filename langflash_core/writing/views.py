"""Files of drawn views: colours, heat-maps, masks, labels, depth, numbers, and COCO's masks."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from langflash_core.base.files import make_folder, staged_folder
from langflash_core.base.outputs import LABELS, MASK
from langflash_core.export import depth
from langflash_core.export.coco import write_coco
from langflash_core.export.npz import write_npz, write_view
from langflash_core.export.paint import write_picture
from langflash_core.export.png import heat_over, label_map, to_8bit, write_labels, write_mask, write_rgb
from langflash_core.types import Camera, QueryResult
from langflash_core.writing.job import Answers, Job, check_found, kept_of, plural


def write_pictures(job: Job) -> str:
    """A picture per camera: colours, one phrase's heat-map, masks, or labels with a legend.

    Raises:
        LangFlashError: nothing answers, or a picture cannot be written.
    """
    cameras = job.cameras()
    targets = job.targets(cameras)
    answers: list[Answers] = []
    with job.renderer() as renderer, staged_folder(job.request.output.parent) as staging:
        if job.prompts:
            for target, result in zip(targets, job.answers(cameras, renderer), strict=True):
                _write_answered(job, staging / target.name, result)
                answers.append(kept_of(result))
            check_found(answers)
        else:
            for index, (camera, target) in enumerate(zip(cameras, targets, strict=True)):
                job.progress("drawing", index / len(cameras))
                frame = renderer(job.scene, camera, weight_maps=False)
                write_picture(staging / target.name, to_8bit(frame.rgb))
    return _describe_views(job, cameras, targets, answers)


def _write_answered(job: Job, path: Path, result: QueryResult) -> None:
    """One picture of an answer."""
    if job.kind is LABELS:
        write_labels(path, label_map(result), [answer.prompt for answer in result.answers])
    elif job.kind is MASK:
        write_mask(path, result.masks.any(0))
    else:
        lit_from = result.answers[0].lit_from
        lit = heat_over(result.relevance[0], result.frame.rgb, lit_from, result.mode, job.colours)
        write_picture(path, to_8bit(lit))


def _describe_views(
    job: Job, cameras: Sequence[Camera], targets: Sequence[Path], answers: Sequence[Answers]
) -> str:
    size = f"{cameras[0].width} x {cameras[0].height}"
    if job.request.all_views:
        size += f", {', '.join(target.name for target in targets)}"
    if job.kind is not LABELS:
        return size
    found = len({a.prompt for view in answers for a in view if a.found})
    legends = ", ".join(target.with_suffix(".json").name for target in targets)
    return f"{found} of {len(job.prompts)} phrases, legend in {legends}"


def write_depth(job: Job) -> str:
    """Depth of every camera, as EXR or as steps of 16 bits, one step for all.

    Raises:
        LangFlashError: a file cannot be written, or the package for it is missing.
    """
    cameras = job.cameras()
    targets = job.targets(cameras)
    metres = job.scene.record.metric_scale
    unit, maps, exr = depth.unit_name(metres), [], job.request.output.suffix.lower() == ".exr"
    with job.renderer() as renderer:
        for index, camera in enumerate(cameras):
            job.progress("drawing", index / len(cameras))
            maps.append(depth.lengths(renderer(job.scene, camera, weight_maps=False), metres))
    longest = max(float(lengths.max()) for lengths in maps)
    step = depth.fitting_step(longest)
    with staged_folder(job.request.output.parent) as staging:
        for lengths, target in zip(maps, targets, strict=True):
            if exr:
                depth.write_depth_exr(staging / target.name, lengths, unit)
            else:
                depth.write_depth_png(staging / target.name, lengths, step, unit)
    size, units = f"{cameras[0].width} x {cameras[0].height}", "m" if unit == "m" else "scene units"
    scale = units if exr else f"depth = value * {step:g} {units}"
    return f"{size}, {scale}, at most {longest:.3g}"


def write_numbers(job: Job) -> str:
    """Relevance and masks of the phrases, or, without one, the view with its weight maps and dictionary.

    Raises:
        LangFlashError: a phrase cannot be used, or the file cannot be written.
    """
    camera, path = job.choice.at_full_size().of(job.scene), job.request.output
    with job.renderer() as renderer:
        job.progress("drawing", 0.2)
        make_folder(path.parent)
        if job.prompts:
            (result,) = job.answers([camera], renderer)
            write_npz(result, path)
            return f"{len(job.prompts)} phrases over {camera.width} x {camera.height}"
        write_view(renderer(job.scene, camera), job.scene.semantics, camera, path)
    return f"{camera.width} x {camera.height} with {job.scene.semantics.num_atoms} weight maps"


def write_coco_masks(job: Job) -> str:
    """COCO instances of one view, or of every photo's, with the views' pictures beside the file.

    Raises:
        LangFlashError: nothing answers, or a file cannot be written.
    """
    cameras, output = job.cameras(), job.request.output
    job.targets(cameras)
    names = [picture.name for picture in job.kind.files_beside(output, len(cameras))]
    answers: list[Answers] = []

    def pictured(results: Iterator[QueryResult]) -> Iterator[QueryResult]:
        for name, result in zip(names, results, strict=True):
            write_rgb(staging / name, result.frame.rgb)
            answers.append(kept_of(result))
            yield result

    with job.renderer() as renderer, staged_folder(output.parent) as staging:
        write_coco(pictured(job.answers(cameras, renderer)), names, staging / output.name)
        check_found(answers)
    masks = sum(answer.found for view in answers for answer in view)
    return f"{plural(masks, 'mask')}, pictures in {', '.join(names)}"
