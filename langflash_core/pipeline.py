"""The only composer: photos -> scene, and scene + phrases -> answer.

images.load_views -> network.predict -> scene.assemble -> scene.prune
render -> query.relevance_maps -> query.answer
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.ahead import Ahead, begin
from langflash_core.detail import DEFAULT_DETAIL, check_gaussians, chosen_detail
from langflash_core.errors import InputError, PromptError, ViewError, WeightsError
from langflash_core.export.html import Beside, Phrases, TextModel, write_html
from langflash_core.fine import fine_scene
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.images.decode import grey_photo
from langflash_core.images.straight import after, straightened
from langflash_core.images.triage import check_shown
from langflash_core.images.views import load_views, source_pictures
from langflash_core.keeping import Keep, not_kept
from langflash_core.kept_prediction import arrays_of, prediction_of
from langflash_core.language.answers import answer
from langflash_core.language.clip import load_clip_images
from langflash_core.language.gaussians import gaussian_relevance
from langflash_core.language.minilm import load_minilm, shipped_files
from langflash_core.language.relevance import Mode, compile_query, finite_dictionary, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import all_phrases
from langflash_core.network import PRESETS, LangFlashNet, choose_pair, load_network
from langflash_core.network.build import network_class
from langflash_core.network.checkpoints.parts import part_folder
from langflash_core.network.checkpoints.stored import Stored, weights_file
from langflash_core.network.model import Atoms, Geometry, Lifted, Redrawn, pooled_weights
from langflash_core.network.precision import bfloat16_fails, has_bfloat16
from langflash_core.network.semantics.aggregation import averaged_atoms
from langflash_core.network.semantics.crops import crop_atoms
from langflash_core.network.semantics.grouping import Groups
from langflash_core.network.semantics.lifting import lifted_weights
from langflash_core.network.semantics.outlines import Outlines
from langflash_core.network.semantics.sam2 import Sam2, sam2_checkpoint
from langflash_core.records import BentLens
from langflash_core.resources import asset_path
from langflash_core.running import Kept, Progress, Run
from langflash_core.scene.assemble import assemble
from langflash_core.scene.prune import prune
from langflash_core.scene.tour import Note, Stop, read_tour
from langflash_core.scene.world import in_world
from langflash_core.splat import render as render_reference
from langflash_core.splat.refine import Budget, refine
from langflash_core.types import Camera, Cost, Frame, Prediction, QueryResult, Scene, Views

# Where each stage begins in the whole, from its measured share of the time on two CPU cores.
STAGES = {"photos": 0.0, "weights": 0.08, "network": 0.16, "assemble": 0.66, "refine": 0.97}
PRECISIONS = ("auto", "float32", "bfloat16")
AGGREGATIONS = ("lfa", "average", "crops")
GROUPINGS = ("queries", "mobile-sam", "sam2")
LARGEST_PICTURE = 8192
LONGEST_REFINEMENT = 3600  # seconds
_STRAIGHTENED = 3  # times, at most
_PATIENCE = 0.2  # seconds, until it is told again how far something is
_AS_IT_IS = "the preset '{}' makes one Gaussian a pixel; the detail that was asked for is left out"
_NOT_TOLD = "; these photos do not determine it by themselves"
_networks: dict[tuple, LangFlashNet] = {}


def reconstruct(
    photos: Sequence[Path | str],
    *,
    preset: str = "mini",
    weights: Path | str | None = None,
    fov: float | Sequence[float | None] | None = None,
    intrinsics: tuple[float, float, float, float] | None = None,
    size: int | None = None,
    device: str = "auto",
    precision: str = "auto",
    aggregation: str | None = None,
    grouping: str | None = None,
    detail: str | None = DEFAULT_DETAIL,
    gaussians: int | None = None,
    refine_seconds: float | None = None,
    viewmats: Tensor | None = None,
    keep: Path | str | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    ahead: Ahead | None = None,
) -> Scene:
    """Photos of one room to a 3D scene that can be queried, in one forward pass.

    Args:
        photos: one or more files; the first one's camera becomes the world.
        preset: size of the network. weights: its checkpoint, None for the shipped one.
        fov: degrees, of the photos' longer side, one for all or one per photo. intrinsics:
            (fx, fy, cx, cy) in pixels of the photos as given, the same for all. Neither: EXIF, else
            an assumption with a warning.
        size: the network sees about size x size pixels per photo, whatever their shape.
        precision: "float32"; "bfloat16", in the parts that bear it; "auto" takes bfloat16 on graphics
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
        refine_seconds: so long poses and Gaussians are fitted to the photos afterwards, and kept so
            if that brings a view closer that was held out; None: not at all.
        viewmats: poses (V, 4, 4) of the photos, world to camera, in any world and unit: they are not
            sought, and the scene is in that world; preset mini. None: the first photo's camera is the world.
        device: "auto" takes CUDA where there is one; "cpu"; "cuda".
        keep: a folder for what is done of it: matches, each photo's depth, what the network found. The same
            photos and settings go on from there, to the same bits. `keeping.forget` clears it. None: nowhere.
        progress: called with the stage and the fraction of the whole in [0, 1].
        cancelled: asked between stages, photos and pairs of photos, and before every layer.
        ahead: of `ahead.begin` with the same arguments, which may have been called before torch was
            imported; None: begun here.

    Returns:
        A scene on the CPU; its record holds seconds per stage, peak memory and warnings.

    Raises:
        ImageError: a photo cannot be used. InputError: an argument cannot.
        WeightsError: the checkpoint is missing or does not fit. OutputError: `keep` cannot be written.
        Cancelled: `cancelled()` became true.
    """
    run, keep = Run(STAGES, progress, cancelled), None if keep is None else Path(keep)
    device = _device(device)
    _check_detail(detail, gaussians)
    if refine_seconds is not None:
        _check_refinement(refine_seconds, photos)
    with run.stage("photos"):
        ahead = ahead or begin(
            photos,
            preset=preset,
            weights=weights,
            size=size,
            read_weights=False,
            check=run.check,
            keep=keep,
        )
        views = load_views(
            photos, fov=fov, intrinsics=intrinsics, check=run.check, pictures=ahead.pictures.result
        )
        check_shown(views.names, list(views.images))
    views = _posed(views, viewmats, preset)
    with run.stage("weights"):
        network = _network(preset, weights, device, precision, ahead.stored)
        atoms = _atoms(network, aggregation, views)
        groups, redrawn = _groups(network, grouping, device), _redrawn(grouping, device)
        _wait_for_matches(ahead, run)  # key points are found beside the weights
    finer = None if detail is None or not network.surfaces else chosen_detail(detail)
    with run.stage("network"):
        settings = (preset, device, precision, aggregation, grouping, finer is None)

        def predicted(seen: Views) -> Prediction:
            told = run.within("network")

            def made(kept: Kept) -> Prediction:
                handed = ahead.handed(kept, seen.sources)
                return _on_cpu(
                    network.predict(seen, told, cancelled, atoms, groups, redrawn, finer is None, handed)
                )

            if keep is None:
                return made(not_kept)
            kept = _keep(keep, seen, (*settings, _identity(preset, weights)))
            return prediction_of(kept("prediction", lambda: arrays_of(made(kept))))

        prediction, views = _straight(predicted, views)
        views = _through(views, prediction)
    images = views.images[[v for v in range(views.num_views) if v not in prediction.unplaced]]
    with run.stage("assemble"), torch.no_grad():
        if finer is not None:
            told = run.within("assemble")
            scene, light = fine_scene(
                prediction, views, finer, gaussians=gaussians, preset=preset, progress=told
            )
            images = light.corrected(images).clamp(0, 1)
        else:
            if gaussians is not None or detail not in (None, DEFAULT_DETAIL):
                prediction = _noted(prediction, _AS_IT_IS.format(preset))
            scene = prune(assemble(prediction, views, preset=preset))
    if refine_seconds is not None:
        with run.stage("refine"):
            scene = _refined(scene, images, refine_seconds, device, run.within("refine"))
        fitting = {**scene.record.cost.timings, "fitting": run.timings["refine"]}
        scene = scene.with_record(cost=Cost(fitting))
    if prediction.lenses:
        scene = scene.with_record(lens={"found": [asdict(lens) for lens in prediction.lenses]})
    run.check()
    if viewmats is not None:
        unit = scene.record.network_unit
        assert unit is not None, "`assemble` records it"
        scene = in_world(scene, viewmats[0], unit)
    run.report("done", 1.0)
    return _with_record(scene, network, run.timings)


def _wait_for_matches(ahead: Ahead, run: Run) -> None:
    """Until photos are matched; how far that is is told, and it may be cancelled at any time."""
    told = run.within("weights")
    while True:
        try:
            ahead.matched.result(timeout=_PATIENCE)
            return
        except TimeoutError:
            if ahead.matched.done():
                raise
            told(f"weights: {ahead.matching}", ahead.matching.share)


def _identity(preset: str, weights: Path | str | None) -> list[tuple[str, int, int]]:
    """Which weights: the checkpoint and its installed parts, with size and time of change."""
    files = sorted(part_folder(PRESETS[preset]).glob("*.safetensors"))
    with suppress(WeightsError):  # there may be no file but the parts
        files.append(weights_file(preset, None if weights is None else Path(weights)))
    return [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in files if path.is_file()]


def _keep(folder: Path, views: Views, settings: tuple) -> Keep:
    """Where what these views become is kept; hangs on all that changes a bit of it."""
    machine = (torch.__version__, torch.get_num_threads(), torch.backends.cpu.get_cpu_capability())
    said = {"settings": settings, "machine": machine, "names": views.names, "lenses": views.lenses}
    numbers = [views.images, views.Ks] + ([] if views.viewmats is None else [views.viewmats])
    parts = (values.contiguous().numpy().tobytes() for values in numbers)
    return Keep.of(folder, said, (*views.sources, *parts))


def query(
    scene: Scene,
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
        prompts: phrases, or one.
        view: input photo whose camera is used, from 0; not asked for where `camera` is given.
        size: (width, height) in pixels; None: the camera's own.
        mode: "relevancy" in (0, 1) or "cosine" in [-1, 1].
        negatives, threshold: instead of the scene's calibration.
        render: draws colour, depth and weight maps; None: the reference in torch.

    Raises:
        ViewError: there is no such view, or the size cannot be drawn.
        PromptError: a prompt or the threshold cannot be used.
        WeightsError: the language space has no text weights.
    """
    chosen = _camera(scene, view, camera, size)
    phrases = [prompts] if isinstance(prompts, str) else list(prompts)
    space = language_space(scene.semantics.space)
    compiled = compile_query(scene, space, phrases, negatives=negatives, mode=mode)
    with torch.no_grad():
        frame = (render or render_reference)(scene, chosen)
        if frame.weight_maps is None:
            raise ValueError("render: expected a frame with weight maps, received one without")
        relevance = relevance_maps(frame.weight_maps, compiled)
        return answer(relevance, frame, chosen, compiled, threshold)


def select(scene: Scene, prompts: Sequence[str], *, threshold: float | None = None) -> Scene:
    """The part of a scene that answers at least one of these phrases, whatever the view.

    Args:
        threshold: relevancy in [0, 1] from which a Gaussian is kept; None: the scene's calibration.

    Raises:
        PromptError: a prompt or the threshold cannot be used, or no Gaussian passes.
        WeightsError: the language space has no text weights.
    """
    compiled = compile_query(scene, language_space(scene.semantics.space), list(prompts))
    limit = compiled.threshold if threshold is None else threshold
    _check_threshold(limit)
    best = gaussian_relevance(scene.semantics, compiled).amax(0)  # (N,)
    passing = best >= limit if scene.semantics.num_atoms else torch.zeros_like(best, dtype=torch.bool)
    if not bool(passing.any()):
        asked, highest = ", ".join(prompts), float(best.max()) if len(best) else 0.0
        raise PromptError(
            f"nothing in the scene answers {asked} (best score {highest:.3f}, threshold {limit:.3f}); "
            "lower the threshold"
        )
    return scene.rows(passing)


def web_page(
    scene: Scene,
    path: Path,
    prompts: Sequence[str] = (),
    *,
    threshold: float | None = None,
    with_text: bool = False,
    title: str | None = None,
    beside: Mapping[str, Scene] | None = None,
) -> Phrases | None:
    """Write a web page that shows the scene and answers these phrases and the whole vocabulary.

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
    others = beside or {}
    said = {other.semantics.space for other in (scene, *others.values())}
    if len(said) > 1:
        raise InputError(
            f"scenes of one page speak one language, not {', '.join(sorted(said))}; leave some out"
        )
    if with_text and scene.semantics.space != "minilm":
        raise InputError(f"a page reads words of 'minilm' only, the scene speaks '{scene.semantics.space}'")
    toured = [each.phrase for s in (scene, *others.values()) for each in _of_tour(s) if each.phrase]
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


def _of_tour(scene: Scene) -> tuple[Stop | Note, ...]:
    tour = read_tour(scene.record.tour)
    return (*tour.stops, *tour.notes)


def _page_phrases(
    scene: Scene, texts: Sequence[str], num_asked: int, threshold: float | None, with_text: bool
) -> Phrases:
    """What a page answers of a scene.

    Raises:
        PromptError: a text or the threshold cannot be used.
    """
    compiled = compile_query(scene, language_space(scene.semantics.space), list(texts))
    limit = compiled.threshold if threshold is None else threshold
    _check_threshold(limit)
    atoms = compiled.factor  # of which D = atoms Q: products with phrases are the same
    return Phrases(
        texts=compiled.texts,
        num_asked=num_asked,
        scores=compiled.prompts @ atoms.T,
        negatives=compiled.negatives @ atoms.T,
        gram=atoms @ atoms.T,
        temperature=compiled.temperature,
        threshold=limit,
        dictionary=finite_dictionary(scene, language_space("minilm")) if with_text else None,
    )


def _text_model() -> TextModel:
    """The shipped tower as a page takes it.

    Raises:
        WeightsError: its files are missing or damaged.
    """
    weights, _ = shipped_files()
    ids = load_minilm().tokenizer.get_vocab()
    names = ("minilm_l6_v2.md", "minilm_l6_v2_LICENSE.txt", "xfeat_LICENSE.txt")  # Apache 2.0
    licences = [asset_path(f"licences/{name}") for name in names]
    return TextModel(
        weights=weights.read_bytes(),
        tokens=tuple(sorted(ids, key=lambda token: ids[token])),
        licence="\n".join(licence.read_text(encoding="utf-8") for licence in licences),
    )


def _check_threshold(threshold: float) -> None:
    if not 0 <= threshold <= 1:
        raise PromptError(f"the threshold {threshold} is out of range; relevancy needs 0 to 1")


def _posed(views: Views, viewmats: Tensor | None, preset: str) -> Views:
    """The views with the poses that were given, brought to the first camera.

    Raises:
        InputError: another preset, or not a pose for each photo.
    """
    if viewmats is None:
        return views
    if preset != "mini":
        raise InputError(f"the preset '{preset}' seeks poses itself; choose --preset mini for given ones")
    if tuple(viewmats.shape) != (views.num_views, 4, 4):
        raise InputError(f"{len(viewmats)} poses were given for {views.num_views} photos; give one each")
    relative = viewmats.double() @ invert_rigid(viewmats[0].double())
    return replace(views, viewmats=relative)


def _straight(predict: Callable[[Views], Prediction], views: Views) -> tuple[Prediction, Views]:
    """A prediction, and the views it is of: straightened where their lenses bend lines.

    The first round sees a strong bend only where the photos hardly show it, so the photos are straightened by
    what all rounds say together, until nothing is left of it.
    """
    taken = views
    for left in reversed(range(_STRAIGHTENED + 1)):
        if views.lenses is not None and not left:
            views = replace(views, lenses=replace(views.lenses, straight=True))
        try:
            return predict(views), views
        except BentLens as bent:
            assert views.lenses is not None, "bends are sought of lenses that are known"
            before = views.lenses.straightened or (None,) * len(bent.found)
            found = [
                old if new is None else after(old, new) for old, new in zip(before, bent.found, strict=True)
            ]
            views = straightened(taken, found)
    raise AssertionError("the last round seeks no bends")


def _through(views: Views, prediction: Prediction) -> Views:
    """The views with the lens that was found; the warning that it was assumed goes, or says what is left."""
    if prediction.Ks is not None:
        views = replace(views, Ks=prediction.Ks)
    if views.lenses is None or not views.lenses.note:
        return views
    note, settled = views.lenses.note, views.lenses.settled(prediction.lenses)
    kept = () if settled else ((f"{note}{_NOT_TOLD}",) if views.num_views > 2 else (note,))
    return replace(views, warnings=(*(w for w in views.warnings if w != note), *kept))


def best_pair(
    photos: Sequence[Path | str], *, cancelled: Callable[[], bool] | None = None
) -> tuple[int, int] | None:
    """The two photos that make the best scene together: much in common, seen from different places.

    Returns:
        Their places in `photos`; None where no two photos match.

    Raises:
        ImageError: a photo cannot be used. Cancelled: `cancelled()` became true.
    """
    run = Run(STAGES, None, cancelled)
    greys = []
    for photo in photos:
        run.check()
        greys.append(grey_photo(Path(photo)))
    return choose_pair(greys, run.check)


def _with_record(scene: Scene, network: LangFlashNet, timings: dict[str, float]) -> Scene:
    """The scene with the cost of its making, and the network's calibration, in its record.

    `timings` stay disjoint seconds in order (the network's and the scene's own steps are in the
    scene already); `seconds` sums them up for the network and for all.
    """
    before = {name: timings[name] for name in ("photos", "weights")}
    cost = Cost(
        timings={**before, **scene.record.cost.timings},
        seconds={"network": timings["network"], "total": sum(timings.values())},
        peak_memory_mb=peak_memory_mb(),
    )
    return scene.with_record(cost=cost, calibration=dict(network.calibration))


def _check_detail(detail: str | None, gaussians: int | None) -> None:
    if detail is not None:
        chosen_detail(detail)
    check_gaussians(gaussians)


def _noted(prediction: Prediction, note: str) -> Prediction:
    return replace(prediction, warnings=(*prediction.warnings, note))


def _check_refinement(seconds: float, photos: Sequence) -> None:
    if not 0 < seconds <= LONGEST_REFINEMENT:
        raise InputError(
            f"a refinement of {seconds:g} seconds is out of range; choose up to {LONGEST_REFINEMENT}"
        )
    if len(photos) < 2:
        raise InputError("a refinement compares photos with each other; give at least two that overlap")


def _refined(scene: Scene, images: Tensor, seconds: float, device: str, progress: Progress) -> Scene:
    """The scene fitted to its photos, or as it was with a warning that says why; on the CPU again."""
    try:
        result = refine(_moved(scene, device), images.to(device), Budget(seconds), progress)
    except InputError as reason:
        return scene.with_record(warnings=(*scene.record.warnings, f"not refined: {reason}"))
    fitted = result.recorded().scene
    record, warnings = fitted.record.refinement, scene.record.warnings
    if not result.kept:
        before, after = record["held_out_psnr_db"]
        note = f"not refined: {record['held_out']}, held out, came no closer ({before} dB, then {after} dB)"
        warnings = (*warnings, note)
    return _moved(fitted, "cpu").with_record(warnings=warnings)


def _moved(scene: Scene, device: str) -> Scene:
    """Gaussians and cameras on a device."""
    return replace(
        scene,
        gaussians=scene.gaussians.map(lambda values: values.to(device)),
        viewmats=scene.viewmats.to(device),
        Ks=scene.Ks.to(device),
    )


def peak_memory_mb() -> int | None:
    """The most memory that this process has held so far, in MB; None where it cannot be asked."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, KiB on Linux
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6)


def _atoms(network: LangFlashNet, way: str | None, views: Views) -> Atoms | None:
    """How groups get their vectors; None: as the network does it.

    Raises:
        InputError: an unknown way, or one that this preset does not have. WeightsError: no weights for it.
    """
    if way is None:
        return None
    if way == "average":
        return lambda weights, features: averaged_atoms(pooled_weights(weights, features), features)[0]
    if way == "lfa":
        if not network.aggregated:
            raise WeightsError("the aggregation has no weights here; choose --aggregation average or crops")
        return None
    if way != "crops":
        raise InputError(f"the aggregation '{way}' is unknown; choose {', '.join(AGGREGATIONS)}")
    if network.preset.space != "clip":
        raise InputError(
            f"crops are embedded by CLIP, but the preset '{network.preset.name}' speaks "
            f"'{network.preset.space}'; choose --aggregation lfa or average"
        )
    tower, photos = load_clip_images(), source_pictures(views)
    return lambda weights, _: crop_atoms(weights, photos, lambda p: tower.encode(p.cpu()).to(weights))


def _groups(network: LangFlashNet, way: str | None, device: str) -> Lifted | None:
    """Where groups come from; None: the network's own parts.

    Raises:
        InputError: an unknown way. WeightsError: no weights for it.
    """
    if way not in (None, *GROUPINGS):
        raise InputError(f"the grouping '{way}' is unknown; choose {', '.join(GROUPINGS)}")
    trained = way in ("queries", "mobile-sam")
    if trained and not network.grouped:
        raise WeightsError("the grouping has no weights here; `langflash weights get langflash` fetches them")
    if trained or (way is None and (network.grouped or sam2_checkpoint() is None)):
        return None
    oracle = Sam2(device)

    def lifted(geometry: Geometry, views: Views) -> Tensor:
        found = [oracle(photo) for photo in views.images]
        groups = [Groups(s.logits[None, None], s.scores.clamp(1e-6, 1 - 1e-6).logit()[None]) for s in found]
        return lifted_weights(groups, geometry, views.Ks)

    return lifted


def _redrawn(way: str | None, device: str) -> Redrawn | None:
    """What gives groups finer outlines; None: they stay as they are.

    Raises:
        WeightsError: no weights for it.
    """
    if way != "mobile-sam":
        return None
    outlines = Outlines.installed(device)
    return lambda weights, views: outlines(weights, source_pictures(views))


def _bfloat16(preset: str, precision: str, device: str) -> bool:
    if precision not in PRECISIONS:
        raise InputError(f"the precision '{precision}' is unknown; choose {', '.join(PRECISIONS)}")
    if precision == "bfloat16" and device == "cpu" and bfloat16_fails():
        raise InputError(
            "ATEN_CPU_CAPABILITY hides what this processor needs for bfloat16; "
            "take it out of the environment, or choose --precision float32"
        )
    if precision != "auto":
        return precision == "bfloat16"
    return device != "cpu" or (network_class(PRESETS[preset]).bfloat16_on_cpu and has_bfloat16())


def _network(
    preset: str, weights: Path | str | None, device: str, precision: str, stored: Future[Stored] | None
) -> LangFlashNet:
    """The network, read once; a checkpoint that changed on disk is read again."""
    path = None if weights is None else Path(weights).resolve()
    changed = path.stat().st_mtime_ns if path is not None and path.is_file() else 0
    folder = part_folder(PRESETS[preset])
    installed = tuple((p.name, p.stat().st_mtime_ns) for p in sorted(folder.glob("*.safetensors")))
    mixed = _bfloat16(preset, precision, device)
    key = (preset, path, device, mixed, changed, installed)
    network = _networks.get(key)
    if network is None:
        read = None if stored is None else stored.result()
        network = load_network(preset, path, device, bfloat16=mixed, stored=read)
        _networks.clear()  # two are too much memory
        _networks[key] = network
    return network


def _on_cpu(prediction: Prediction) -> Prediction:
    tensors = {name: value.cpu() for name, value in vars(prediction).items() if isinstance(value, Tensor)}
    return replace(prediction, gaussians=prediction.gaussians.map(Tensor.cpu), **tensors)


def _device(name: str) -> str:
    if name not in ("auto", "cpu", "cuda"):
        raise InputError(f"the device '{name}' is unknown; choose auto, cpu or cuda")
    if name == "cuda" and not torch.cuda.is_available():
        raise InputError("there is no CUDA device that torch can use; choose --device cpu or auto")
    return ("cuda" if torch.cuda.is_available() else "cpu") if name == "auto" else name


def _camera(scene: Scene, view: int, camera: Camera | None, size: tuple[int, int] | None) -> Camera:
    """The camera asked for, at the size asked for."""
    if size is not None and not all(1 <= side <= LARGEST_PICTURE for side in size):
        raise ViewError(
            f"a picture of {size[0]}x{size[1]} cannot be drawn; choose 1 to {LARGEST_PICTURE} pixels"
        )
    if camera is None:
        if not 0 <= view < scene.num_views:
            raise ViewError(f"there is no view {view}; the scene has views 0 to {scene.num_views - 1}")
        camera = scene.camera(view)
    return camera if size is None else camera.resized(*size)
