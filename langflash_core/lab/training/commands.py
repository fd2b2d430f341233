"""`langflash train ...`: cache rooms, train stages on rooms and photos, export weights.

Plain functions; the command line only parses arguments. Text embeddings come in as a function, because
training does not import the query stage.
"""

import json
import logging
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.rooms import HELD_OUT_LIBRARIES, VALIDATION_LIBRARIES, RoomRenderer, load_pack
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.cache import (
    HELD_OUT_SEED,
    VALIDATION_SEED,
    CachePlan,
    fill_cache,
    rooms_renderer,
)
from langflash_core.lab.training.live import LivePhotos
from langflash_core.lab.training.loop import LoopOptions, Validate, train_stage
from langflash_core.lab.training.mixing import MixedSet
from langflash_core.lab.training.naming import NAMING
from langflash_core.lab.training.parts import PartSet, run_parts
from langflash_core.lab.training.real import MODULES, JointSet, KeptPhotos, PhotoTargets, train_late
from langflash_core.lab.training.recipes import Recipe, named_recipe, stages_of
from langflash_core.lab.training.stages import Stage, Words, guided, language_stage, modules_of
from langflash_core.lab.training.states import LoopState, load_averaged
from langflash_core.lab.training.validation import MEASURES, Validator
from langflash_core.lab.training.words import PhraseSampler, PhraseTable, build_table
from langflash_core.network.build import network_class
from langflash_core.network.checkpoints.files import adopt_frozen, initial_network, save_network, start_from
from langflash_core.network.checkpoints.parts import TRAINED_HERE, fingerprint, write_part
from langflash_core.network.checkpoints.store import network_to_train
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import has_bfloat16
from langflash_core.network.presets import PRESETS

log = logging.getLogger(__name__)

LATE = Stage("late", MODULES, (), {1: 1.0}, 6, 6e-4, language_stage)
"""What `train late` leaves in a run for the stages after it; `real` says how it learns."""
ALL_STAGES = stages_of("mini")

_UNTRAINED = "holds no trained stage; run `langflash train run` first"

Encode = Callable[[Sequence[str]], Tensor]
SETS = ("train", "validation", "held_out")
VALIDATION_SCENES = 48
"""Judged while training, every few minutes; more would cost more time than they tell."""


def cache_plan(kind: str, scenes: int, first_seed: int | None = None, preset: str = "mini") -> CachePlan:
    """The plan of one set: train (tokens, augmented), validation (tokens; furniture that rules drew
    from other seeds), held_out (pictures only; models by people whose library no training sees). Squares
    without tokens for a network that takes these.

    Raises:
        InputError: there is no such set.
    """
    plan, network = _cache_plan(kind, scenes, first_seed), PRESETS[preset]
    if not network.square:
        return plan
    side = round(network.native_area**0.5)
    return replace(plan, with_tokens=False, sizes=((side, side),))


def _cache_plan(kind: str, scenes: int, first_seed: int | None) -> CachePlan:
    if kind == "train":
        return CachePlan(first_seed or 0, scenes)
    if kind == "validation":
        return CachePlan(
            first_seed or VALIDATION_SEED,
            scenes,
            libraries=VALIDATION_LIBRARIES,
            augment=False,
            three_view_every=1,
        )
    if kind == "held_out":
        return CachePlan(
            first_seed or HELD_OUT_SEED,
            scenes,
            libraries=HELD_OUT_LIBRARIES,
            with_tokens=False,
            augment=False,
            three_view_every=1,
        )
    raise InputError(f"there is no set '{kind}'; choose one of {', '.join(SETS)}")


def run_cache(
    out: Path,
    pack: Path,
    start: Path | None,
    *,
    kind: str = "train",
    scenes: int = 4096,
    first_seed: int | None = None,
    part: tuple[int, int] = (0, 1),
    preset: str = "mini",
) -> int:
    """Render and encode one set into `out/<kind>`; returns the number of scenes written.

    Single-threaded: run one process per core with `part` (i, n). Interrupted runs continue.

    Args:
        pack: furniture (`langflash rooms pack`).
        start: weights file of the preset, whose encoder is used; None where the cache keeps no tokens.
    """
    torch.set_num_threads(1)
    plan = cache_plan(kind, scenes, first_seed, preset)
    encoder = None
    if plan.with_tokens and start is not None:
        encoder = guided(initial_network(PRESETS[preset], start)).encoder
    furniture = load_pack(pack)
    began = time.perf_counter()
    with RoomRenderer(furniture) as renderer:
        render = rooms_renderer(furniture, renderer, plan.libraries)
        written = fill_cache(out / kind, plan, render, encoder, part)
    log.info("%d scenes in %.0f s", written, time.perf_counter() - began)
    return written


def run_train(
    stages: Sequence[str],
    folder: Path,
    run_dir: Path,
    start: Path | None,
    encode: Encode,
    minutes: Sequence[float],
    *,
    preset: str = "mini",
    options: LoopOptions | None = None,
    from_scratch: bool = False,
) -> LangFlashNet:
    """Train stages one after the other, each for its minutes, on the cached sets in `folder`.

    Earlier stages are read from `run_dir`; a stage found there continues unless
    `options.resume` is False. Returns the network with every stage trained so far.

    Args:
        start: weights file of the preset. Its frozen parts are used, and stages without a run of
            their own begin with its heads, as far as these still fit the network. None: what is imported
            for a preset that nothing is shipped for.
        from_scratch: draw the heads anew instead.

    Raises:
        InputError: an unknown stage, a stage whose needs have not been trained, or no cache.
    """
    recipe = named_recipe(stages, minutes, preset, options or LoopOptions(minutes=0))
    return run_recipe(recipe, folder, run_dir, start, encode, from_scratch=from_scratch)


def run_recipe(
    recipe: Recipe,
    folder: Path,
    run_dir: Path,
    start: Path | None,
    encode: Encode,
    *,
    from_scratch: bool = False,
) -> LangFlashNet:
    """Train the stages of a recipe; everything else as `run_train`."""
    _open(folder / "train")
    table = phrase_table(folder, encode)
    network, done = _prepared(recipe, run_dir, start, from_scratch=from_scratch)
    known = stages_of(recipe.preset)
    for plan in recipe.plans:
        stage, options = plan.stage, plan.options
        missing = [need for need in stage.needs if need not in done]
        if missing:
            raise InputError(
                f"stage '{stage.name}' reads {', '.join(missing)}; train that first with the same run folder"
            )
        seed = options.seed + 1000 * list(known).index(stage.name) + done.get(stage.name, 0)
        words = Words(PhraseSampler(table), torch.Generator().manual_seed(seed))
        learned = _learned(stage, folder)
        if isinstance(learned, PartSet) and stage.name not in done:
            namer = guided(network).namer
            namer.mean, namer.std = learned.statistics()
        check = _validator(stage, folder, table, options)
        state = train_stage(network, stage, learned, words, run_dir, options, check)
        done[stage.name] = state.step
    return network.eval()


def _prepared(
    recipe: Recipe, run_dir: Path, start: Path | None, *, from_scratch: bool
) -> tuple[LangFlashNet, dict[str, int]]:
    """The network to train, and the steps of every stage that has weights already."""
    preset, known = PRESETS[recipe.preset], stages_of(recipe.preset)
    if network_class(preset).compact:
        if start is None:
            raise InputError(f"training '{recipe.preset}' begins with a weights file; give one with --start")
        network = initial_network(preset, start, recipe.seed)
        done = _load_trained(network, run_dir)
        return network, done if from_scratch else done | dict.fromkeys(_begin(network, start, done), 0)
    drawn = {name for plan in recipe.plans for name in plan.stage.modules} if from_scratch else set()
    network, filled = network_to_train(preset, start, recipe.seed, drawn)
    done = {name: 0 for name, stage in known.items() if filled.issuperset(modules_of(network, stage))}
    return network, done | _load_trained(network, run_dir)


def run_late(
    folder: Path,
    photos: PhotoFolder,
    ids: Sequence[str],
    kept: Sequence[str],
    run_dir: Path,
    start: Path,
    encode: Encode,
    options: LoopOptions,
    *,
    preset: str = "mini",
) -> LoopState:
    """Train the late half, and the heads that read it, on labelled photos and the cached rooms.

    Args:
        ids: of the photos to learn from. kept: of those to judge by now and then. start: weights file that
            the run begins with.

    Raises:
        InputError: no cache, or a photo cannot be used.
    """
    rooms = _open(folder / "train")
    network = initial_network(PRESETS[preset], start, options.seed)
    _begin(network, start, ())
    live = LivePhotos(photos, ids)
    words = Words(PhraseSampler(phrase_table(folder, encode)), torch.Generator().manual_seed(options.seed))
    targets = PhotoTargets.of(photos, live, encode)
    check = KeptPhotos(LivePhotos(photos, kept), targets, options.device) if kept else None
    return train_late(network, targets, JointSet(live, rooms), words, run_dir, options, check)


def _open(folder: Path, limit: int | None = None, *, photos: bool = False) -> RoomSet:
    try:
        return RoomSet(folder, limit=limit, partly=photos)
    except ValueError as error:
        raise InputError(str(error)) from None


def _photos(folder: Path, part: str) -> Path | None:
    """Where `train cache --photos` puts a part; None if nothing is there."""
    place = folder / "photos" / part
    return place if place.is_dir() else None


def _learned(stage: Stage, folder: Path) -> RoomSet | MixedSet | PartSet:
    """What a stage learns from: rooms, and photos where some are cached and the stage can use them."""
    if stage.name == NAMING.name:
        return _parts(folder, "train")
    rooms, photos = _open(folder / "train"), _photos(folder, "train")
    if stage.photos == 0 or photos is None:
        return rooms
    return MixedSet(rooms, _open(photos, photos=True), stage.photos)


def _validator(stage: Stage, folder: Path, table: PhraseTable, options: LoopOptions) -> Validate | None:
    """The stage's measure on validation rooms and, under names that begin with "photos_", on photos."""
    name = stage.name
    if not (folder / "validation").is_dir() or name not in MEASURES:
        return None
    measure, views = MEASURES[name]

    def judge(judged: RoomSet | PartSet) -> Validator:
        words = Words(PhraseSampler(table), torch.Generator().manual_seed(1))
        return Validator(judged, words, measure, views, options.device)

    if name == NAMING.name:
        return judge(_parts(folder, "validation"))
    rooms = judge(_open(folder / "validation", VALIDATION_SCENES))
    place = _photos(folder, "validation")
    if stage.photos == 0 or place is None:
        return rooms
    photos = judge(_open(place, photos=True))
    return lambda network: {
        **rooms(network),
        **{f"photos_{key}": value for key, value in photos(network).items()},
    }


def _parts(folder: Path, part: str) -> PartSet:
    """The parts of rooms, and of photos where there are any."""
    photos = _photos(folder, part)
    folders = [folder / part / "parts", *([photos / "parts"] if photos is not None else [])]
    try:
        return PartSet(*folders)
    except ValueError as error:
        raise InputError(str(error)) from None


def run_find_parts(
    folder: Path,
    start: Path,
    run_dir: Path | None = None,
    *,
    part: tuple[int, int] = (0, 1),
    preset: str = "mini",
) -> int:
    """Find the parts of every cached training and validation room and photo, for the stage `naming`; how
    many.

    They lie in `parts` beside the shards. Single-threaded, resumable and divisible as `run_cache`;
    files of an earlier network have to be taken away first.

    Args:
        start: weights file. run_dir: stages trained there replace its heads.

    Raises:
        InputError: no cache.
    """
    torch.set_num_threads(1)
    network = initial_network(PRESETS[preset], start)
    done = _load_trained(network, run_dir) if run_dir is not None else {}
    _begin(network, start, done)
    if has_bfloat16():
        network.use_bfloat16()
    count = 0
    for name in ("validation", "train"):
        places = [folder / name] if name == "train" or (folder / name).is_dir() else []
        photos = _photos(folder, name)
        for place in [*places, *([photos] if photos is not None else [])]:
            found = _open(place).folder
            count += run_parts(guided(network.eval()), found, found / "parts", part)
    return count


def phrase_table(folder: Path, encode: Encode) -> PhraseTable:
    """Every phrase of the training and validation rooms and photos; embedded once, kept beside the
    shards."""
    labels = _open(folder / "train").labels()
    others = [folder / "validation", _photos(folder, "train"), _photos(folder, "validation")]
    extra = [
        label for place in others if place is not None and place.is_dir() for label in _open(place).labels()
    ]
    path = folder / "phrases.pt"
    known: dict[str, Tensor] = {}
    if path.exists():
        saved = torch.load(path, weights_only=True)
        known = dict(zip(saved["phrases"], saved["embeddings"], strict=True))

    def remembered(phrases: Sequence[str]) -> Tensor:
        fresh = [phrase for phrase in phrases if phrase not in known]
        if fresh:
            known.update(zip(fresh, encode(fresh), strict=True))
        return torch.stack([known[phrase] for phrase in phrases])

    table = build_table([*labels, *extra], remembered)
    temporary = path.with_suffix(f".{time.time_ns()}.part")
    torch.save({"phrases": list(table.phrases), "embeddings": table.embeddings}, temporary)
    temporary.replace(path)
    return table


def _load_trained(network: LangFlashNet, run_dir: Path) -> dict[str, int]:
    """Steps of every stage in a run, whose weights the network then has; the late half, and what learned
    with it, before those that went on."""
    names = (LATE.name, *stages_of(network.preset.name))
    found = {name: load_averaged(network, run_dir, name) for name in names}
    return {name: counts[0] for name, counts in found.items() if counts is not None}


def _begin(network: LangFlashNet, start: Path, done: Iterable[str]) -> list[str]:
    """The stages whose modules are trained in a run or could be filled from `start`, but for `done`."""
    done = set(done)
    filled = {module for name in done for module in (LATE if name == LATE.name else ALL_STAGES[name]).modules}
    if LATE.name not in done:
        start_from(network, start, ("late",))
    names = [name for name in ALL_STAGES if name not in done]
    return [
        name
        for name in names
        if start_from(network, start, [m for m in ALL_STAGES[name].modules if m not in filled])
    ]


def run_adopt(encoder: Path, local: Path, out: Path, *, preset: str = "mini") -> Path:
    """Make a file to start from out of published weights of the frozen parts (see NOTICE)."""
    adopt_frozen(PRESETS[preset], encoder, local, out)
    return out


def run_export(
    run_dir: Path, out: Path, start: Path | None, *, preset: str = "mini", metadata: dict | None = None
) -> Path:
    """Join the averaged weights of every stage in `run_dir` into one weights file; stages that
    were not trained there keep the heads of `start`, and are left out where these are imported anyway.

    The header says how long each stage trained, its last validation, and `metadata` (data,
    metrics, calibration: `calibration` is what queries read).

    Raises:
        InputError: no stage has been trained.
    """
    if not network_class(PRESETS[preset]).compact:
        return _export_part(run_dir, out, start, preset)
    if start is None:
        raise InputError(f"exporting '{preset}' needs the weights file it began with; give it with --start")
    network = initial_network(PRESETS[preset], start)
    trained = {name: load_averaged(network, run_dir, name) for name in (LATE.name, *ALL_STAGES)}
    _begin(network, start, [name for name, counts in trained.items() if counts is not None])
    report = {
        name: {
            "steps": counts[0],
            "hours": round(counts[1] / 3600, 3),
            "validation": last_validation(run_dir, name),
        }
        for name, counts in trained.items()
        if counts is not None
    }
    if not report:
        raise InputError(f"{run_dir} {_UNTRAINED}")
    details = dict(metadata or {})
    network.calibration = details.pop("calibration", {})
    save_network(network, out, {"training": report, **details})
    return out


def _export_part(run_dir: Path, out: Path, start: Path | None, preset: str) -> Path:
    """The modules that a run trained, for the geometry and language features that are imported."""
    network, _ = network_to_train(PRESETS[preset], start, 0)
    known = stages_of(preset)
    trained = [name for name in known if load_averaged(network, run_dir, name) is not None]
    if not trained:
        raise InputError(f"{run_dir} {_UNTRAINED}")
    modules = {module for name in trained for module in modules_of(network, known[name])}
    if "decoder" in modules:
        modules.add("encoder")  # a grouping is good for both of them together
    tensors = {
        name: value for name, value in network.state_dict().items() if name.partition(".")[0] in modules
    }
    reads = fingerprint(network.state_dict())
    write_part(
        out, tensors, network.preset, TRAINED_HERE, run_dir.name, side=network.trained_side, reads=reads
    )
    return out


def last_validation(run_dir: Path, stage: str) -> dict:
    """The newest validation row of a stage's log; {} if it has none."""
    path = run_dir / f"{stage}.jsonl"
    if not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    kept = [row for row in rows if row["kind"] == "validation"]
    return {k: v for k, v in kept[-1].items() if k not in ("stage", "kind")} if kept else {}
