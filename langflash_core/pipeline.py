"""The only composer: photos -> scene (`reconstruction.stages` has the steps), scene + phrases -> answer, or
part of the scene, and scene -> web page. Each reads in at its first call what the others do without: a
question waits for no network.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from langflash_core.base.detail import DEFAULT_DETAIL, DETAILS
from langflash_core.base.resources import asset_path
from langflash_core.base.running import Progress, Run
from langflash_core.errors import InputError, ViewError
from langflash_core.export import open_scene
from langflash_core.images.decode import grey_photo
from langflash_core.images.lens import Intrinsics
from langflash_core.language.answers import answer
from langflash_core.language.minilm import load_minilm, shipped_files
from langflash_core.language.narrowing import narrow_view
from langflash_core.language.relevance import Mode, finite_dictionary, relevance_maps
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import encode_cached, language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.language.vocabulary import all_phrases
from langflash_core.reconstruction.ahead import Ahead
from langflash_core.scene.exposure import lit_camera
from langflash_core.scene.tour import read_tour
from langflash_core.scene.world import upward
from langflash_core.splat import render as render_reference
from langflash_core.splat.compose import some_layers
from langflash_core.types import Camera, Frame, QueryResult, Scene

if TYPE_CHECKING:
    from langflash_core.export.html import Phrases, TextModel
    from langflash_core.reconstruction.networks import Networks

LARGEST_PICTURE = 8192
PAGE_LAYERS = 8
"""Layers of a page: 12 MB, which people still send; a view is blended of the four nearest."""


def reconstruct(
    photos: Sequence[Path | str],
    *,
    preset: str = "mini",
    weights: Path | str | None = None,
    fov: float | Sequence[float | None] | None = None,
    intrinsics: Intrinsics | Sequence[Intrinsics] | None = None,
    size: int | None = None,
    device: str = "auto",
    precision: str = "auto",
    aggregation: str | None = None,
    grouping: str | None = None,
    detail: str | None = DEFAULT_DETAIL,
    gaussians: int | None = None,
    viewmats: Tensor | None = None,
    keep: Path | str | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    ahead: Ahead | None = None,
    networks: "Networks | None" = None,
) -> Scene:
    """Photos of one room to a 3D scene that can be queried, by a small network and exact geometry.

    Args:
        photos: one or more files; the first one's camera becomes the world.
        preset: size of the network. weights: its checkpoint, None for the shipped one.
        fov: degrees, of the photos' longer side, one for all or one per photo. intrinsics:
            (fx, fy, cx, cy) in pixels of the photos as given, the same for all or one per photo.
            Neither: EXIF, else an assumption with a warning.
        size: the network sees about size x size pixels per photo, whatever their shape.
        precision: "float32"; "bfloat16", in the parts that bear it; "auto" takes bfloat16 on CUDA
            cards and, for `full`, on processors that are quick at it.
        aggregation: how a group gets its vector: "lfa" (trained), "average" (of dense features),
            "crops" (CLIP on a cut-out; presets of its space); None: lfa where it has weights,
            else average.
        grouping: where groups come from: "queries" (trained), "mobile-sam" (the same, redrawn with
            MobileSAM's outlines in each photo), "sam2" (its masks of each photo, lifted to the scene);
            None: queries where they have weights, else sam2 where it is installed, else clusters of the
            language features.
        detail: how finely surfaces are covered: "low", "normal", "high"; None: one Gaussian a pixel,
            as the network makes them. Points of `full` are no surfaces: they stay as they are.
        gaussians: about so many, instead of as many as the detail has.
        viewmats: poses (V, 4, 4) of the photos, world to camera, in any world and unit: they are not
            sought, and the scene is in that world; preset mini. None: the first photo's camera is the world.
        device: "cuda", "mps" or "cpu"; "auto" takes the first of these that there is.
        keep: a folder for what is done of it: matches, each photo's depth, what the network found. The same
            photos and settings go on from there, on the same machine with as many threads to the same bits.
            `keeping.forget` clears it. None: nowhere.
        progress: called with the stage and the fraction of the whole in [0, 1].
        cancelled: asked between stages, photos and pairs of photos, and before every layer.
        ahead: of `ahead.begin` with the same arguments, which may have been called before torch was
            imported; None: begun here.
        networks: keeps the network for the next scene; None: the weights are read for this one alone.

    Returns:
        A scene on the CPU; its record holds seconds per stage, peak memory and warnings.

    Raises:
        ImageError: a photo cannot be used. InputError: an argument cannot.
        WeightsError: the checkpoint is missing or does not fit. OutputError: `keep` cannot be written.
        Cancelled: `cancelled()` became true.
    """
    from langflash_core.reconstruction.networks import Networks
    from langflash_core.reconstruction.options import Options
    from langflash_core.reconstruction.stages import STAGES, scene_of

    options = Options(
        photos,
        preset=preset,
        weights=weights,
        fov=fov,
        intrinsics=intrinsics,
        size=size,
        device=device,
        precision=precision,
        aggregation=aggregation,
        grouping=grouping,
        detail=detail,
        gaussians=gaussians,
        viewmats=viewmats,
        keep=None if keep is None else Path(keep),
    )
    run = Run(STAGES, progress, cancelled)
    return scene_of(options, run, Networks() if networks is None else networks, ahead)


def add_photos(
    scene: Scene | Path | str,
    photos: Sequence[Path | str],
    *,
    device: str = "auto",
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    networks: "Networks | None" = None,
) -> Scene:
    """A finished scene with a layer of each of some more photos; what it has stays as it is.

    Each photo is reconstructed with the four of the scene's that show most of the same, which the file keeps,
    so that it costs five photos' time, and being matched with all. What it says is in atoms of its own.

    Args:
        scene: of layers, or the path of one. photos: of the same place. The others as `reconstruct`.

    Raises:
        InputError: the scene has no layers or keeps no photos, or a photo shows nothing of what it shows.
        ImageError, WeightsError, Cancelled: as `reconstruct`.
    """
    from langflash_core.images.pictures import photo_paths
    from langflash_core.reconstruction.adding import scene_with

    scene = open_scene(scene)
    width, height = scene.view_size
    level = scene.record.detail.get("level")

    def make(files: Sequence[Path], fields: Sequence[float], poses: Tensor) -> Scene:
        return reconstruct(
            files,
            fov=fields,
            viewmats=poses,
            size=round(math.sqrt(width * height)),
            detail=level if level in DETAILS else DEFAULT_DETAIL,
            device=device,
            progress=progress,
            cancelled=cancelled,
            networks=networks,
        )

    return scene_with(scene, photo_paths(photos), make, Run({}, progress, cancelled).check)


def query(
    scene: Scene | Path | str,
    prompts: Sequence[str] | str,
    *,
    view: int = 0,
    camera: Camera | None = None,
    size: tuple[int, int] | None = None,
    mode: Mode = "relevancy",
    negatives: Sequence[str] | None = None,
    threshold: float | None = None,
    render: Callable[[Scene, Camera], Frame] | None = None,
) -> QueryResult:
    """Where in one view of a scene are these phrases?

    Args:
        scene: or the path of one.
        prompts: phrases, or one.
        view: input photo whose camera is used, from 0; not asked for where `camera` is given.
        size: (width, height) in pixels; None: the camera's own. It is drawn in the light of its place
            (`scene.exposure`).
        mode: "relevancy" in (0, 1) or "cosine" in [-1, 1].
        negatives, threshold: instead of the scene's calibration.
        render: draws colour, depth and weight maps; None: the reference in torch.

    Raises:
        ViewError: there is no such view, or the size cannot be drawn.
        PromptError: a prompt or the threshold cannot be used.
        WeightsError: the language space has no text weights.
        SceneFileError: the path holds no scene. InputError: neither a scene nor a path was given.
    """
    scene = open_scene(scene)
    chosen = seen_from(scene, view, camera, size)
    phrases = [prompts] if isinstance(prompts, str) else list(prompts)
    space = language_space(scene.semantics.space)
    compiled = compile_spoken(scene, space, phrases, negatives=negatives, mode=mode)
    with torch.no_grad():
        frame = (render or render_reference)(scene, chosen)
        if frame.weight_maps is None:
            raise ValueError("render: expected a frame with weight maps, received one without")
        relevance = relevance_maps(frame.weight_maps, compiled)
        if compiled.narrows:
            others = None if compiled.others is None else relevance_maps(frame.weight_maps, compiled.others)
            limits = [compiled.threshold if threshold is None else threshold] * len(phrases)
            relevance, compiled = narrow_view(
                compiled, relevance, others, frame, chosen, upward(scene.record.world), limits
            )
        return answer(relevance, frame, chosen, compiled, threshold)


def select(
    scene: Scene | Path | str, prompts: Sequence[str] | str, *, threshold: float | None = None
) -> Scene:
    """The part of a scene that answers at least one of these phrases, whatever the view.

    Args:
        scene: or the path of one. prompts: phrases, or one.
        threshold: relevancy in [0, 1] from which a Gaussian is kept; None: the scene's calibration.

    Raises:
        PromptError: a prompt or the threshold cannot be used, or no Gaussian passes.
        WeightsError: the language space has no text weights.
    """
    from langflash_core.meant import answering

    scene, prompts = open_scene(scene), [prompts] if isinstance(prompts, str) else prompts
    return scene.rows(torch.from_numpy(answering(scene, prompts, threshold)))


def web_page(
    scene: Scene,
    path: Path,
    prompts: Sequence[str] = (),
    *,
    threshold: float | None = None,
    with_text: bool = False,
    title: str | None = None,
    beside: Mapping[str, Scene] | None = None,
) -> "Phrases | None":
    """Write a web page that shows the scene and answers these phrases and the whole vocabulary; of a scene of
    layers it holds those of `page_layers`.

    Args:
        prompts: shown as asked from the start.
        threshold: relevancy in [0, 1] from which a phrase counts as present; None: the scene's calibration.
        with_text: the page holds the text tower of `minilm`, too, and answers any phrase; 28 MB more.
        title: of the page; None: the file's name.
        beside: other scenes in the same page, by their titles; asked the same.

    Returns:
        What the page answers; None for a scene without language that was asked nothing.

    Raises:
        PromptError: a prompt or the threshold cannot be used. WeightsError: the space has no text weights.
        InputError: a scene speaks another space than the first, or none that `with_text` reads.
        OutputError: the scene holds no Gaussians, or the path cannot be written.
    """
    from langflash_core.export.html import Beside, write_html

    scene, others = page_layers(scene), {name: page_layers(other) for name, other in (beside or {}).items()}
    said = {other.semantics.space for other in (scene, *others.values())}
    if len(said) > 1:
        raise InputError(
            f"scenes of one page speak one language, not {', '.join(sorted(said))}; leave some out"
        )
    if with_text and scene.semantics.space != "minilm":
        raise InputError(f"a page reads words of 'minilm' only, the scene speaks '{scene.semantics.space}'")
    tours = [read_tour(each.record.tour) for each in (scene, *others.values())]
    toured = [each.phrase for tour in tours for each in (*tour.stops, *tour.notes) if each.phrase]
    texts = tuple(dict.fromkeys((*prompts, *toured, *all_phrases())))
    asked = len(dict.fromkeys(prompts))
    first, *rest = (
        _page_phrases(each, texts, asked, threshold, with_text) if asked or each.semantics.num_atoms else None
        for each in (scene, *others.values())
    )
    write_html(
        scene,
        path,
        phrases=first,
        text_model=_text_model() if with_text else None,
        title=title,
        beside=[Beside(s, name, own) for (name, s), own in zip(others.items(), rest, strict=True)],
    )
    return first


def page_layers(scene: Scene) -> Scene:
    """The scene as a page holds it: of many layers `PAGE_LAYERS` that lie all over the walk."""
    return some_layers(scene, PAGE_LAYERS) if scene.layered else scene


def _page_phrases(
    scene: Scene, texts: Sequence[str], num_asked: int, threshold: float | None, with_text: bool
) -> "Phrases":
    """What a page answers of a scene."""
    from langflash_core.export.html import Phrases
    from langflash_core.meant import check_threshold

    space = language_space(scene.semantics.space)
    compiled = compile_spoken(scene, space, list(texts))  # of heads alone
    limit = compiled.threshold if threshold is None else threshold
    check_threshold(limit)
    atoms = compiled.factor  # of which D = atoms Q: products with phrases are the same
    leads, dictionary = space.leads(), finite_dictionary(scene, space)
    met = dictionary + dictionary.norm(dim=-1, keepdim=True) * leads.direction.to(dictionary)
    return Phrases(
        texts=compiled.texts,
        num_asked=num_asked,
        scores=compiled.prompts @ atoms.T,
        negatives=compiled.negatives @ atoms.T,
        gram=atoms @ atoms.T,
        temperature=compiled.temperature,
        threshold=limit,
        half=ANSWERING.half if threshold is None else 0.0,
        dictionary=met if with_text else None,
        rivals=encode_cached(space, space.rivals) if with_text else None,
        lead=leads.offset,
    )


def _text_model() -> "TextModel":
    """The shipped tower as a page takes it."""
    from langflash_core.export.html import TextModel

    weights, _ = shipped_files()
    ids = load_minilm().tokenizer.get_vocab()
    names = ("minilm_l6_v2.md", "minilm_l6_v2_LICENSE.txt", "xfeat_LICENSE.txt")  # Apache 2.0
    licences = [asset_path(f"licences/{name}") for name in names]
    return TextModel(
        weights=weights.read_bytes(),
        tokens=tuple(sorted(ids, key=lambda token: ids[token])),
        licence="\n".join(licence.read_text(encoding="utf-8") for licence in licences),
    )


def best_pair(
    photos: Sequence[Path | str], *, cancelled: Callable[[], bool] | None = None
) -> tuple[int, int] | None:
    """The two photos that make the best scene together: much in common, seen from different places.

    Returns:
        Their places in `photos`; None where no two photos match.

    Raises:
        ImageError: a photo cannot be used. Cancelled: `cancelled()` became true.
    """
    from langflash_core.cameras.pairs import choose_pair
    from langflash_core.reconstruction.stages import STAGES

    run = Run(STAGES, None, cancelled)
    greys = []
    for photo in photos:
        run.check()
        greys.append(grey_photo(Path(photo)))
    return choose_pair(greys, run.check)


def seen_from(scene: Scene, view: int, camera: Camera | None, size: tuple[int, int] | None) -> Camera:
    """The camera asked for, at the size asked for, in the light of its place; as `query` takes them.

    Raises:
        ViewError: there is no such view, or the size cannot be drawn.
    """
    if size is not None and not all(1 <= side <= LARGEST_PICTURE for side in size):
        raise ViewError(
            f"a picture of {size[0]}x{size[1]} cannot be drawn; choose 1 to {LARGEST_PICTURE} pixels"
        )
    if camera is None:
        if not 0 <= view < scene.num_views:
            raise ViewError(f"there is no view {view}; the scene has views 0 to {scene.num_views - 1}")
        camera = scene.camera(view)
    return lit_camera(scene, camera if size is None else camera.with_size(*size))
