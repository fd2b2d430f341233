"""`langflash export`: a scene, or what answers a phrase, as a file other programs read."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TextIO

from langflash_core.colormaps import HeatColours
from langflash_core.detail import EXPORT_DETAILS
from langflash_core.errors import InputError, PromptError, SceneFileError
from langflash_core.formats import (
    ALL_OUT,
    ANSWERS_OUT,
    CAMERAS_OUT,
    COLOUR_MAPS,
    FILMS_OUT,
    PAGE_OUT,
    SCENES_OUT,
    SOG_FOLDER,
    kind_of,
)
from langflash_core.types import Camera, PromptAnswer, QueryResult, Scene

from .. import shots
from ..cameras import CameraChoice, chosen_camera
from ..files import (
    check_beside,
    check_folder,
    check_output_file,
    check_same_kind,
    readable_file,
    staged_folder,
)
from ..renderers import Renderer, open_renderer
from ..report import ProgressBar
from ..scenes import open_scene
from .query import spoken

Answers = tuple[PromptAnswer, ...]  # of one view
OF_GAUSSIANS = ("cutout", "soft", "instances")  # decided in 3D, the same in all views
TABLES = {".json": ".json of masks", ".csv": ".csv of boxes", ".glb": ".glb of boxes"}
JSON_KEYS = {
    ".json": ("images", "annotations"),
    "boxes": ("prompt", "box"),
    SOG_FOLDER: ("means",),
    "transforms.json": ("frames",),
}  # what tells one kind of .json from another
NEED_A_PHRASE = ("heat", "mask", "soft", "cutout", "labels", "instances", "boxes", "surface")
KINDS = {
    "boxes": tuple(TABLES),
    "surface": (".glb",),
    "depth": (".png", ".exr"),
    "heat": (".png", *FILMS_OUT),
}


def run(args: Namespace, out: TextIO) -> None:
    """Write what the suffix of -o says; with --prompt only what answers it.

    Raises:
        LangFlashError: the scene, a phrase, the camera or the output cannot be used, or
            nothing answers.
    """
    prompts = spoken(args.prompt or [])
    suffix = _checked_output(args)
    _check_words(args, suffix, prompts)
    json_kind = "boxes" if args.what == "boxes" and suffix == ".json" else suffix
    if json_kind in JSON_KEYS and not args.replace:
        check_same_kind(args.output, JSON_KEYS[json_kind])
    choice = chosen_camera(args)
    readable_file(args.scene, "scene", SceneFileError)
    if suffix in FILMS_OUT:
        from ..video import check_encoder

        check_encoder()
    write = _write_segmented if args.segmented else _writer(suffix, args.what)
    print(f"{args.output}: {write(args, open_scene(args.scene), prompts, choice)}", file=out)


def write_whole(scene: Scene, path: Path, renderer: Renderer, prompts: Sequence[str]) -> None:
    """What `export` writes of a scene without further options: all of it, or of every photo's view what
    answers the phrases where `path` is a table or masks of them (`ANSWERS_OUT`), a web page with them asked.

    Raises:
        LangFlashError: the path cannot be written, or no mask is found.
    """
    suffix = kind_of(path)
    looks = ("view", "camera", "size", "ortho")
    unset = dict.fromkeys(("threshold", "what", "seconds", "path", "span", *looks))
    asked = list(prompts) if suffix in (*ANSWERS_OUT, PAGE_OUT) else []
    off = dict.fromkeys(("with_text", "replace", "fade", "fill"), False)
    said = {"all_views": suffix == ".csv", "colormap": COLOUR_MAPS[0], "detail": EXPORT_DETAILS[0], **off}
    args = Namespace(scene=path.parent, output=path, prompt=asked, backend=renderer, **said, **unset)
    _writer(suffix, None)(args, scene, asked, CameraChoice(0, None, None))


def _writer(suffix: str, what: str | None) -> Callable[..., str]:
    if what == "boxes" or suffix == ".csv":
        return _write_boxes
    if what == "surface":
        return _write_surface
    if what == "depth" or suffix == ".exr":
        return _write_depth
    others = {
        **dict.fromkeys(FILMS_OUT, _write_video),
        ".json": _write_masks,
        ".npz": _write_numbers,
        ".png": _write_pictures,
        PAGE_OUT: _write_page,
    }
    return others.get(suffix, _write_scene)


def _checked_output(args: Namespace) -> str:
    """What the name of -o says it is; "" for a folder.

    Raises:
        OutputError: it cannot be written.
    """
    if not args.segmented:
        return kind_of(check_output_file(args.output, ALL_OUT, inputs=[args.scene]))
    check_folder(args.output)
    return ""


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
    if args.segmented and (not prompts or args.what is not None):
        raise PromptError('--segmented needs phrases and no --what; add --prompt "armchair"')
    if prompts and (args.what in ("rgb", "depth") or suffix == ".exr"):
        what = f"--what {args.what}" if args.what else "an .exr of depth"
        raise PromptError(f"{what} takes no --prompt; use --what cutout, mask, heat or labels")
    allowed = (".png",) if args.what is None else KINDS.get(args.what, (".png",))
    if args.what is not None and suffix not in allowed:
        ends = " or ".join(allowed)
        raise InputError(f"--what {args.what} takes a {ends}; name one instead of {args.output.name}")
    for name in ("seconds", "path"):
        if getattr(args, name) is not None and suffix not in FILMS_OUT:
            raise InputError(f"--{name} is for videos; name an .mp4 or .webp, or leave it away")
    if args.what != "heat" and (args.span is not None or args.colormap != COLOUR_MAPS[0]):
        raise InputError("--colormap and --span colour heat-maps; add --what heat, or leave them away")
    if args.with_text and suffix != PAGE_OUT:
        raise InputError("--with-text is for web pages; name an .html, or leave it away")
    if args.detail == "low" and (args.what or suffix not in (*SCENES_OUT, PAGE_OUT)):
        raise InputError("--detail low is for splats, scenes and web pages; name one, or leave it away")
    whole = suffix in (".png", *FILMS_OUT) and args.what in (None, "rgb") and not prompts
    if args.fill and not (whole or args.what == "heat"):
        raise InputError("--fill is for pictures and films of the whole scene and heat-maps; leave it away")
    _check_camera_words(args, suffix)


def _check_camera_words(args: Namespace, suffix: str) -> None:
    looked_at = [name for name in ("view", "camera", "size", "ortho") if getattr(args, name) is not None]
    if args.segmented and args.all_views:
        raise InputError("--segmented looks from every photo by itself; leave --all-views away")
    if args.all_views:
        if set(looked_at) - {"size", "ortho"}:
            raise InputError(f"--all-views looks from every photo; leave --{looked_at[0]} away")
        looked_at.append("all-views")
    if suffix in (*SCENES_OUT, *CAMERAS_OUT, PAGE_OUT) and looked_at and args.what != "boxes":
        raise InputError(f"a {suffix} holds what all views show, not one; leave --{looked_at[0]} away")
    if args.fade and suffix in (*SCENES_OUT, *CAMERAS_OUT, PAGE_OUT) and args.what != "boxes":
        raise InputError(f"a {suffix} holds the whole scene, and only views fade; leave --fade away")
    extra = [name for name in looked_at if name != "size"]
    if suffix in FILMS_OUT and extra:
        raise InputError(f"a video moves by itself; leave --{extra[0]} away, or say --path")


def _write_scene(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from langflash_core.export import export
    from langflash_core.export.language import side_car
    from langflash_core.export.sog import sog_files
    from langflash_core.files import make_folder

    chosen = _selected(args, _as_fine(args, scene), prompts)
    make_folder(args.output.parent)
    export(chosen, args.output)
    if kind_of(args.output) in CAMERAS_OUT:
        return f"{scene.num_views} photos in images/ and their poses"
    share = f" of {len(scene.gaussians):,}" if len(chosen.gaussians) < len(scene.gaussians) or prompts else ""
    beside = f", its language in {side_car(args.output).name}" if _has_side_car(args.output, chosen) else ""
    files = sog_files(args.output) if kind_of(args.output) == SOG_FOLDER else [args.output]
    megabytes = sum(file.stat().st_size for file in files) / 1e6
    return f"{len(chosen.gaussians):,}{share} Gaussians, {megabytes:.1f} MB{beside}"


def _write_page(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """A web page with the whole scene; --prompt says what it shows as asked."""
    from langflash_core import pipeline
    from langflash_core.files import make_folder

    shown = _as_fine(args, scene)
    with ProgressBar() as progress:
        progress("reading the vocabulary", 0.2)
        make_folder(args.output.parent)
        phrases = pipeline.web_page(
            shown,
            args.output,
            prompts,
            threshold=args.threshold,
            with_text=args.with_text,
            title=args.scene.stem,
        )
    known = "any phrase" if args.with_text else f"{len(phrases.texts)} phrases" if phrases else ""
    answers = f", answers {known}" if known else ""
    share = f" of {len(scene.gaussians):,}" if shown is not scene else ""
    return f"{len(shown.gaussians):,}{share} Gaussians, {args.output.stat().st_size / 1e6:.1f} MB{answers}"


def _has_side_car(path: Path, scene: Scene) -> bool:
    return kind_of(path) == ".ply" and scene.semantics.num_atoms > 0


def _as_fine(args: Namespace, scene: Scene) -> Scene:
    from langflash_core.scene.thin import coarse_level

    return coarse_level(scene) if args.detail == "low" else scene


def _selected(args: Namespace, scene: Scene, prompts: list[str]) -> Scene:
    from langflash_core import pipeline

    return pipeline.select(scene, prompts, threshold=args.threshold) if prompts else scene


def _write_pictures(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """A picture per camera: colours, one phrase's heat-map, masks, a cut-out, or labels with a legend."""
    cameras, targets = _shots(args, scene, choice)
    if prompts and args.what in (None, *OF_GAUSSIANS):
        from ..segmented.files import write_parts

        return write_parts(args, scene, prompts, cameras, targets)
    colours = HeatColours(args.colormap, args.span)
    with (
        ProgressBar() as progress,
        open_renderer(args.backend, fade=args.fade, fill=args.fill) as renderer,
        staged_folder(args.output.parent) as staging,
    ):
        answers = []
        if prompts:
            views = _answered(args, scene, prompts, cameras, renderer, progress)
            for target, result in zip(targets, views, strict=True):
                shots.write_answered(args.what, staging / target.name, result, colours)
                answers.append(result.answers)
            _check_found(answers)
        else:
            for index, (camera, target) in enumerate(zip(cameras, targets, strict=True)):
                progress("drawing", index / len(cameras))
                shots.write_plain(staging / target.name, renderer(scene, camera, weight_maps=False))
    return _told(args, prompts, answers, cameras, targets)


def _write_numbers(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """Relevance and masks of the phrases, or, without one, the view with its weight maps and dictionary."""
    from langflash_core.export.npz import write_npz, write_view
    from langflash_core.files import make_folder

    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        progress("drawing", 0.2)
        make_folder(args.output.parent)
        if prompts:
            (result,) = _answered(args, scene, prompts, [camera], renderer, progress)
            write_npz(result, args.output)
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
        cameras = _photos_or(args, scene, choice)
        names = [f"{output.stem}_{view}{output.suffix}" for view in range(scene.num_views)]
        targets = [output.with_name(name) for name in names]
    else:
        cameras, targets = [choice.of(scene)], [output]
    with_legend = args.what in ("labels", "instances")
    legends = [target.with_suffix(".json") for target in targets] if with_legend else []
    for target in (*targets, *legends):
        check_output_file(target, inputs=[args.scene])
    for legend, target in zip(legends, targets, strict=False) if not args.replace else ():
        check_beside(legend, legend, target)
    return cameras, targets


def _told(args: Namespace, prompts: list[str], answers: list[Answers], cameras, targets) -> str:
    size = f"{cameras[0].width} x {cameras[0].height}"
    if args.all_views:
        size += f", {', '.join(target.name for target in targets)}"
    if args.what != "labels":
        return size
    found = len({a.prompt for view in answers for a in view if a.found})
    legends = ", ".join(target.with_suffix(".json").name for target in targets)
    return f"{found} of {len(prompts)} phrases, legend in {legends}"


def _write_boxes(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """Where each phrase is and how large, as JSON, CSV or glTF; a row or a box per phrase and view."""
    cameras = _shots(args, scene, choice)[0] if args.all_views else [choice.of(scene)]
    views = [None] if args.camera is not None else [args.view or 0]
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        results = _answered(args, scene, prompts, cameras, renderer, progress)
        rows = shots.box_rows(results, range(scene.num_views) if args.all_views else views, scene)
    shots.write_boxes(args.output, rows)
    found = sum(row["found"] for row in rows)
    return f"{found} of {len(rows)} found"


def _write_depth(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from ..segmented.files import write_depth

    return write_depth(args, scene, *_shots(args, scene, choice))


def _write_surface(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from ..segmented.files import write_surface

    return write_surface(args, scene, prompts)


def _write_segmented(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """The folder of every photo's view, or of the one that is named."""
    from ..segmented.folder import write_folder
    from ..segmented.subject import taken_apart

    cameras = _photos_or(args, scene, choice)
    numbers = list(range(len(cameras))) if _of_photos(args) else [choice.view]
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        subject = taken_apart(scene, prompts, args.threshold, cameras, numbers, renderer)
        return write_folder(args.output, subject, args, progress)


def _of_photos(args: Namespace) -> bool:
    """Whether no view is named, so that every photo's is meant."""
    return args.view is None and args.camera is None


def _photos_or(args: Namespace, scene: Scene, choice: CameraChoice) -> list[Camera]:
    if not _of_photos(args):
        return [choice.of(scene)]
    return [choice.of_photo(scene, view) for view in range(scene.num_views)]


def _write_masks(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    """COCO instances of one view, or of every photo's, with the views' pictures beside the file."""
    from langflash_core.export.coco import write_coco
    from langflash_core.export.png import write_rgb

    cameras = _photos_or(args, scene, choice)
    names = [f"{args.output.stem}_{index}.png" for index in range(len(cameras))]
    for picture in map(args.output.with_name, names):
        check_output_file(picture, inputs=[args.scene])
        if not args.replace:
            check_beside(picture, args.output, picture)
    answers: list[Answers] = []

    def pictured(results: Iterator[QueryResult]) -> Iterator[QueryResult]:
        for name, result in zip(names, results, strict=True):
            write_rgb(staging / name, result.frame.rgb)
            answers.append(result.answers)
            yield result

    with (
        ProgressBar() as progress,
        open_renderer(args.backend, fade=args.fade) as renderer,
        staged_folder(args.output.parent) as staging,
    ):
        results = _answered(args, scene, prompts, cameras, renderer, progress)
        write_coco(pictured(results), names, staging / args.output.name)
        _check_found(answers)
    masks = sum(answer.found for view in answers for answer in view)
    return f"{masks} mask{'s' * (masks > 1)}, pictures in {', '.join(names)}"


def _write_video(args: Namespace, scene: Scene, prompts: list[str], choice: CameraChoice) -> str:
    from .. import video

    heat = args.what == "heat"
    chosen = scene if heat else _selected(args, scene, prompts)
    cameras = video.way(args.path, scene, chosen, args.size, args.seconds)
    asked = video.asked(scene, prompts[0], args.threshold) if heat else None
    with (
        ProgressBar() as progress,
        open_renderer(args.backend, fade=args.fade, fill=args.fill) as renderer,
        staged_folder(args.output.parent) as staging,
    ):
        colours = HeatColours(args.colormap, args.span)
        video.write(staging / args.output.name, chosen, cameras, renderer, progress, asked, colours)
    return f"{len(cameras) / video.RATE:.1f} s, {cameras[0].width} x {cameras[0].height}"


def _answered(
    args: Namespace,
    scene: Scene,
    prompts: list[str],
    cameras: Sequence[Camera],
    renderer: Renderer,
    progress: Callable[[str, float], None],
) -> Iterator[QueryResult]:
    """View after view; each holds the weight maps of all atoms, so keep only what is needed of it."""
    from langflash_core import pipeline

    for index, camera in enumerate(cameras):
        progress("drawing", index / len(cameras))
        yield pipeline.query(scene, prompts, camera=camera, threshold=args.threshold, render=renderer)


def _check_found(answers: list[Answers]) -> None:
    """Raises:
    PromptError: no view answers any phrase.
    """
    if not any(answer.found for view in answers for answer in view):
        asked = ", ".join(answer.prompt for answer in answers[0])
        where = "this view" if len(answers) == 1 else "any view"
        best = max(answer.score for view in answers for answer in view)
        raise PromptError(f"not found in {where}: {asked} (best score {best:.3f}); lower --threshold")
