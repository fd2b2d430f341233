"""`langflash export`: a scene, or what answers a phrase, as a file other programs read."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TextIO

from langflash_core.colormaps import HeatColours
from langflash_core.errors import InputError, PromptError, SceneFileError
from langflash_core.formats import (
    ALL_OUT,
    ANSWERS_OUT,
    CAMERAS_OUT,
    COLOUR_MAPS,
    PAGE_OUT,
    SCENES_OUT,
    kind_of,
)
from langflash_core.types import Camera, QueryResult, Scene

from .. import shots
from ..cameras import CameraChoice, chosen_camera
from ..files import check_beside, check_output_file, readable_file, staged_folder
from ..renderers import Renderer, open_renderer
from ..report import ProgressBar
from ..scenes import open_scene
from .query import spoken

TABLES = {".json": ".json of masks", ".csv": ".csv of boxes", ".glb": ".glb of boxes"}
NEED_A_PHRASE = ("heat", "mask", "cutout", "labels", "boxes")


def run(args: Namespace, out: TextIO) -> None:
    """Write what the suffix of -o says; with --prompt only what answers it.

    Raises:
        LangFlashError: the scene, a phrase, the camera or the output cannot be used, or
            nothing answers.
    """
    prompts = spoken(args.prompt or [])
    suffix = kind_of(check_output_file(args.output, ALL_OUT, inputs=[args.scene]))
    _check_words(args, suffix, prompts)
    choice = chosen_camera(args)
    readable_file(args.scene, "scene", SceneFileError)
    if suffix == ".mp4":
        from ..video import check_encoder

        check_encoder()
    write = _writer(suffix, args.what)
    print(f"{args.output}: {write(args, open_scene(args.scene), prompts, choice)}", file=out)


def write_whole(scene: Scene, path: Path, renderer: Renderer, prompts: Sequence[str]) -> None:
    """What `export` writes of a scene without further options: all of it, or of every photo's view what
    answers the phrases where `path` is a table or masks of them (`ANSWERS_OUT`), a web page with them asked.

    Raises:
        LangFlashError: the path cannot be written, or no mask is found.
    """
    suffix = kind_of(path)
    unset = dict.fromkeys(("threshold", "what", "seconds", "view", "camera", "size"))
    asked = list(prompts) if suffix in (*ANSWERS_OUT, PAGE_OUT) else []
    said = {"all_views": suffix == ".csv", "with_text": False, "replace": False}
    args = Namespace(scene=path.parent, output=path, prompt=asked, backend=renderer, **said, **unset)
    _writer(suffix, None)(args, scene, asked, CameraChoice(0, None, None))


def _writer(suffix: str, what: str | None) -> Callable[..., str]:
    if what == "boxes" or suffix == ".csv":
        return _write_boxes
    others = {
        ".mp4": _write_video,
        ".json": _write_masks,
        ".npz": _write_numbers,
        ".png": _write_pictures,
        PAGE_OUT: _write_page,
    }
    return others.get(suffix, _write_scene)


def _check_words(args: Namespace, suffix: str, prompts: list[str]) -> None:
    """Options that do not go together.

    Raises:
        InputError: says which.
    """
    if args.threshold is not None and not prompts:
        raise PromptError('--threshold needs a phrase; add --prompt "armchair"')
    if not prompts and (suffix in ANSWERS_OUT or args.what in NEED_A_PHRASE):
        what = f"--what {args.what}" if args.what in NEED_A_PHRASE else f"a {TABLES.get(suffix)}"
        raise PromptError(f'{what} needs a phrase; add --prompt "armchair"')
    if args.what == "heat" and len(prompts) > 1:
        raise PromptError("--what heat draws one phrase; use --what labels for several")
    if args.what == "rgb" and prompts:
        raise PromptError("--what rgb takes no --prompt; use --what cutout, mask, heat or labels")
    if args.what == "boxes" and suffix not in TABLES:
        raise InputError(f"--what boxes takes a .json, .csv or .glb; name one instead of {args.output.name}")
    if args.what not in (None, "boxes") and suffix != ".png":
        raise InputError(f"--what {args.what} is a picture; name a .png instead of {args.output.name}")
    if args.what != "heat" and (args.span is not None or args.colormap != COLOUR_MAPS[0]):
        raise InputError("--colormap and --span colour heat-maps; add --what heat, or leave them away")
    if args.seconds is not None and suffix != ".mp4":
        raise InputError("--seconds is for videos; name an .mp4, or leave it away")
    if args.with_text and suffix != PAGE_OUT:
        raise InputError("--with-text is for web pages; name an .html, or leave it away")
    _check_camera_words(args, suffix)


def _check_camera_words(args: Namespace, suffix: str) -> None:
    looked_at = [name for name in ("view", "camera", "size") if getattr(args, name) is not None]
    if args.all_views:
        if set(looked_at) - {"size"}:
            raise InputError(f"--all-views looks from every photo; leave --{looked_at[0]} away")
        looked_at.append("all-views")
    if suffix in (*SCENES_OUT, *CAMERAS_OUT, PAGE_OUT) and looked_at and args.what != "boxes":
        raise InputError(f"a {suffix} holds the whole scene, not a view of it; leave --{looked_at[0]} away")
    extra = [name for name in looked_at if name != "size"]
    if suffix == ".mp4" and extra:
        raise InputError(f"a video moves between the views by itself; leave --{extra[0]} away")


def _write_scene(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from langflash_core.export import export
    from langflash_core.export.language import side_car
    from langflash_core.files import make_folder

    chosen = _selected(args, scene, prompts)
    make_folder(args.output.parent)
    export(chosen, args.output)
    if kind_of(args.output) in CAMERAS_OUT:
        return f"{scene.num_views} photos in images/ and their poses"
    share = f" of {len(scene.gaussians):,}" if prompts else ""
    beside = f", its language in {side_car(args.output).name}" if _has_side_car(args.output, chosen) else ""
    return f"{len(chosen.gaussians):,}{share} Gaussians, {args.output.stat().st_size / 1e6:.1f} MB{beside}"


def _write_page(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """A web page with the whole scene; --prompt says what it shows as asked."""
    from langflash_core import pipeline
    from langflash_core.files import make_folder

    with ProgressBar() as progress:
        progress("reading the vocabulary", 0.2)
        make_folder(args.output.parent)
        phrases = pipeline.web_page(
            scene,
            args.output,
            prompts,
            threshold=args.threshold,
            with_text=args.with_text,
            title=args.scene.stem,
        )
    known = "any phrase" if args.with_text else f"{len(phrases.texts)} phrases" if phrases else ""
    answers = f", answers {known}" if known else ""
    return f"{len(scene.gaussians):,} Gaussians, {args.output.stat().st_size / 1e6:.1f} MB{answers}"


def _has_side_car(path: Path, scene: Scene) -> bool:
    return kind_of(path) == ".ply" and scene.semantics.num_atoms > 0


def _selected(args: Namespace, scene: Scene, prompts: list[str]) -> Scene:
    from langflash_core import pipeline

    return pipeline.select(scene, prompts, threshold=args.threshold) if prompts else scene


def _write_pictures(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """A picture per camera: colours, one phrase's heat-map, a mask, a cut-out, or labels with a legend."""
    cameras, targets = _shots(args, scene, choice)
    colours = HeatColours(args.colormap, args.span)
    with (
        ProgressBar() as progress,
        open_renderer(args.backend) as renderer,
        staged_folder(args.output.parent) as staging,
    ):
        results = []
        for index, (camera, target) in enumerate(zip(cameras, targets, strict=True)):
            progress("drawing", index / len(cameras))
            place = staging / target.name
            if prompts:
                results.append(_answer(args, scene, prompts, camera, renderer))
                shots.write_answered(args.what or "cutout", place, results[-1], colours)
            else:
                shots.write_plain(place, renderer(scene, camera, weight_maps=False))
        if prompts:
            _check_found(results)
    return _told(args, prompts, results, cameras, targets)


def _write_numbers(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """Relevance and masks of the phrases, or, without one, the view with its weight maps and dictionary."""
    from langflash_core.export.npz import write_npz, write_view
    from langflash_core.files import make_folder

    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        progress("drawing", 0.2)
        make_folder(args.output.parent)
        if prompts:
            write_npz(_answer(args, scene, prompts, camera, renderer), args.output)
            return f"{len(prompts)} phrases over {camera.width} x {camera.height}"
        write_view(renderer(scene, camera), scene.semantics, camera, args.output)
    return f"{camera.width} x {camera.height} with {scene.semantics.num_atoms} weight maps"


def _shots(args: Namespace, scene: Scene, choice: CameraChoice) -> tuple[list[Camera], list[Path]]:
    """Cameras, and the file of each: -o itself, or with --all-views NAME_0, NAME_1 and so on.

    Raises:
        OutputError: one of them cannot be written.
    """
    output = args.output
    if args.all_views:
        cameras = [scene.camera(view, *(args.size or (None, None))) for view in range(scene.num_views)]
        names = [f"{output.stem}_{view}{output.suffix}" for view in range(scene.num_views)]
        targets = [output.with_name(name) for name in names]
    else:
        cameras, targets = [choice.of(scene)], [output]
    legends = [target.with_suffix(".json") for target in targets] if args.what == "labels" else []
    for target in (*targets, *legends):
        check_output_file(target, inputs=[args.scene])
    for legend, target in zip(legends, targets, strict=False) if not args.replace else ():
        check_beside(legend, legend, target)
    return cameras, targets


def _told(args: Namespace, prompts: list[str], results: list[QueryResult], cameras, targets) -> str:
    size = f"{cameras[0].width} x {cameras[0].height}"
    if args.all_views:
        size += f", {', '.join(target.name for target in targets)}"
    if args.what != "labels":
        return size
    found = len({a.prompt for result in results for a in result.answers if a.found})
    legends = ", ".join(target.with_suffix(".json").name for target in targets)
    return f"{found} of {len(prompts)} phrases, legend in {legends}"


def _write_boxes(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """Where each phrase is and how large, as JSON, CSV or glTF; a row or a box per phrase and view."""
    cameras = _shots(args, scene, choice)[0] if args.all_views else [choice.of(scene)]
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        results = []
        for index, camera in enumerate(cameras):
            progress("drawing", index / len(cameras))
            results.append(_answer(args, scene, prompts, camera, renderer))
    views = [None] if args.camera is not None else [args.view or 0]
    rows = shots.box_rows(results, range(scene.num_views) if args.all_views else views, scene)
    shots.write_boxes(args.output, rows)
    found = sum(row["found"] for row in rows)
    return f"{found} of {len(rows)} found"


def _write_masks(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """COCO instances of one view, or of every photo's, with the views' pictures beside the file."""
    from langflash_core.export.coco import write_coco
    from langflash_core.export.png import write_rgb

    if args.view is None and args.camera is None:
        cameras = [scene.camera(view, *(args.size or (None, None))) for view in range(scene.num_views)]
    else:
        cameras = [choice.of(scene)]
    names = [f"{args.output.stem}_{index}.png" for index in range(len(cameras))]
    for picture in map(args.output.with_name, names):
        check_output_file(picture, inputs=[args.scene])
        if not args.replace:
            check_beside(picture, args.output, picture)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        results = []
        for index, camera in enumerate(cameras):
            progress("drawing", index / len(cameras))
            results.append(_answer(args, scene, prompts, camera, renderer))
        _check_found(results)
        with staged_folder(args.output.parent) as staging:
            for name, result in zip(names, results, strict=True):
                write_rgb(staging / name, result.frame.rgb)
            write_coco(results, names, staging / args.output.name)
    masks = sum(answer.found for result in results for answer in result.answers)
    return f"{masks} mask{'s' * (masks > 1)}, pictures in {', '.join(names)}"


def _write_video(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from .. import video

    chosen = _selected(args, scene, prompts)
    cameras = video.tour(scene, args.size or scene.view_size, args.seconds or video.SECONDS)
    with (
        ProgressBar() as progress,
        open_renderer(args.backend) as renderer,
        staged_folder(args.output.parent) as staging,
    ):
        video.write(staging / args.output.name, chosen, cameras, renderer, progress)
    return f"{len(cameras) / video.RATE:.1f} s, {cameras[0].width} x {cameras[0].height}"


def _answer(
    args: Namespace, scene: Scene, prompts: list[str], camera: Camera, renderer: Renderer
) -> QueryResult:
    from langflash_core import pipeline

    return pipeline.query(scene, prompts, camera=camera, threshold=args.threshold, render=renderer)


def _check_found(results: list[QueryResult]) -> None:
    """Raises:
    PromptError: no view answers any phrase.
    """
    answers = [answer for result in results for answer in result.answers]
    if not any(answer.found for answer in answers):
        asked = ", ".join(answer.prompt for answer in results[0].answers)
        where = "this view" if len(results) == 1 else "any view"
        best = max(answer.score for answer in answers)
        raise PromptError(f"not found in {where}: {asked} (best score {best:.3f}); lower --threshold")
