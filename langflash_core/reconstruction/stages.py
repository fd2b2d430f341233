"""The stages of a reconstruction, in order: photos, weights, network, assembly, level.

photos -> Views -> Tools -> Prediction -> Scene. Each is a function of what those before it gave; `Run` times
them and tells how far they are.
"""

from dataclasses import asdict, replace

import torch

from langflash_core.base.detail import DEFAULT_DETAIL
from langflash_core.base.memory import peak_memory_mb
from langflash_core.base.running import Run
from langflash_core.images.triage import check_shown
from langflash_core.images.views import load_views
from langflash_core.level import level_scene
from langflash_core.reconstruction.ahead import Ahead, begin
from langflash_core.reconstruction.finding import predictor
from langflash_core.reconstruction.networks import Networks
from langflash_core.reconstruction.options import Options
from langflash_core.reconstruction.tools import Tools, open_tools
from langflash_core.reconstruction.views import found_views, posed_views, straight_prediction
from langflash_core.scene.world import in_world
from langflash_core.surface.assemble import assemble
from langflash_core.surface.fine import coloured_scene, covered_scene
from langflash_core.surface.prune import prune
from langflash_core.types import Cost, FoundLens, Scene, Views

# Where each begins in the whole, from its measured share of the time on two CPU cores.
STAGES = {"photos": 0.0, "weights": 0.08, "network": 0.16, "assemble": 0.66, "level": 0.98}
_PATIENCE = 0.2  # seconds, until it is told again how far something is
_AS_IT_IS = "the preset '{}' makes one Gaussian a pixel; the detail that was asked for is left out"


def scene_of(options: Options, run: Run, networks: Networks, ahead: Ahead | None) -> Scene:
    """The scene that was asked for; errors and `ahead` as of `pipeline.reconstruct`. However it ends,
    nothing of it runs on."""
    try:
        options = options.settled()
        ahead = ahead or begin(
            options.photos,
            preset=options.preset,
            weights=options.weights,
            size=options.size,
            read_weights=False,
            check=run.check,
            keep=options.keep,
        )
        return _make_scene(options, run, networks, ahead)
    finally:
        if ahead is not None:
            ahead.end()


def _make_scene(options: Options, run: Run, networks: Networks, ahead: Ahead) -> Scene:
    views = _photos(options, run, ahead)
    tools = _weights(options, run, networks, ahead, views)
    scene, lenses = _assemble_scene(options, run, ahead, tools, views)
    if lenses:
        scene = scene.with_record(lens={"found": [asdict(lens) for lens in lenses]})
    run.check()
    if options.viewmats is not None:
        assert scene.record.network_unit is not None, "`assemble` records it"
        scene = in_world(scene, options.viewmats[0], scene.record.network_unit)
    with run.stage("level"):
        scene = level_scene(scene.with_record(calibration=dict(tools.network.calibration)))
    run.report("done", 1.0)
    return _with_cost(scene, run.timings)


def _photos(options: Options, run: Run, ahead: Ahead) -> Views:
    """The photos as views."""
    with run.stage("photos"):
        views = load_views(
            options.photos,
            fov=options.fov,
            intrinsics=options.intrinsics,
            check=run.check,
            pictures=ahead.pictures.result,
        )
        check_shown(views.names, list(views.images))
    return posed_views(views, options.viewmats, options.preset)


def _weights(options: Options, run: Run, networks: Networks, ahead: Ahead, views: Views) -> Tools:
    """The network and its helpers; key points are found beside."""
    with run.stage("weights"):
        tools = open_tools(options, views, networks, ahead.stored)
        _wait_for_matches(ahead, run)
    return tools


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


def _assemble_scene(
    options: Options, run: Run, ahead: Ahead, tools: Tools, views: Views
) -> tuple[Scene, tuple[FoundLens, ...]]:
    """The scene, and the lenses found."""
    with run.stage("network"):
        prediction, views = straight_prediction(predictor(options, tools, ahead, run), views)
        views = found_views(views, prediction)
    lenses = prediction.lenses
    with run.stage("assemble"), torch.no_grad():
        if tools.finer is None:
            if options.gaussians is not None or options.detail not in (None, DEFAULT_DETAIL):
                note = _AS_IT_IS.format(options.preset)
                prediction = replace(prediction, warnings=(*prediction.warnings, note))
            return prune(assemble(prediction, views, preset=options.preset)), lenses
        told = run.within("assemble")
        covered = covered_scene(
            prediction, views, tools.finer,
            gaussians=options.gaussians, preset=options.preset, progress=told,
        )  # fmt: skip
        del prediction  # five megabytes a photo that nobody asks for any more
        return coloured_scene(covered, told), lenses


def _with_cost(scene: Scene, timings: dict[str, float]) -> Scene:
    """The scene with the cost of its making in its record.

    `timings` stay disjoint seconds in order (the network's and the scene's own steps are in the
    scene already); `seconds` sums them up for the network and for all.
    """
    before = {name: timings[name] for name in ("photos", "weights")}
    cost = Cost(
        timings={**before, **scene.record.cost.timings, "level": timings["level"]},
        seconds={"network": timings["network"], "total": sum(timings.values())},
        peak_memory_mb=peak_memory_mb(),
    )
    return scene.with_record(cost=cost)
