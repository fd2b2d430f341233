"""`langflash lab train ...`: cache rooms, train stages on rooms and photos, export weights.

Plain functions; the command line only parses arguments. Text embeddings come in as a function, because
training does not import the query stage.
"""

import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.labels.ade import NAMES
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.rooms import (
    HELD_OUT_LIBRARIES,
    VALIDATION_LIBRARIES,
    Pack,
    RoomRenderer,
    StagedRoom,
    load_pack,
    staged_room,
)
from langflash_core.lab.saving import save_whole
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.cache import (
    HELD_OUT_SEED,
    VALIDATION_SEED,
    CachePlan,
    fill_cache,
    rooms_renderer,
)
from langflash_core.lab.training.dense import DenseSet
from langflash_core.lab.training.fewlabels import NAMES_ALONE
from langflash_core.lab.training.frozen import FrozenSet
from langflash_core.lab.training.further import Sets, judge_of, train_few, train_second
from langflash_core.lab.training.live import LivePhotos
from langflash_core.lab.training.loop import LoopOptions, Validate, train_stage
from langflash_core.lab.training.mixing import MixedSet
from langflash_core.lab.training.naming import NAMING
from langflash_core.lab.training.outlined import outlined_set
from langflash_core.lab.training.parts import PartSet, run_parts
from langflash_core.lab.training.pool import PhotoPool, PhotoSet
from langflash_core.lab.training.real import JointSet, KeptPhotos, PhotoTargets, train_late
from langflash_core.lab.training.recipes import Recipe, stages_of
from langflash_core.lab.training.scenes import SceneSet, SceneSource
from langflash_core.lab.training.second import Scored
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.stages.grouping import taught, untaught
from langflash_core.lab.training.stages.stage import Stage, Words, guided
from langflash_core.lab.training.states import LoopState
from langflash_core.lab.training.trained import begin, load_trained, prepared
from langflash_core.lab.training.validation import MEASURES, Validator
from langflash_core.lab.training.words import PhraseSampler, PhraseTable, build_table
from langflash_core.network.checkpoints.files import adopt_frozen, initial_network
from langflash_core.network.encoders.mobile_sam import SIDE, MobileSamEncoder, load_mobile_sam_encoder
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import has_bfloat16
from langflash_core.network.presets import PRESETS

log = logging.getLogger(__name__)

Encode = Callable[[Sequence[str]], Tensor]
SETS = ("train", "validation", "held_out")
VALIDATION_SCENES = 48
"""Judged while training, every few minutes; more would cost more time than they tell."""


def cache_plan(kind: str, scenes: int, preset: str = "mini") -> CachePlan:
    """The plan of one set: train (tokens, augmented), validation (tokens; furniture that rules drew
    from other seeds), held_out (pictures only; models by people whose library no training sees). Squares
    without tokens for a network that takes these.

    Raises:
        InputError: there is no such set.
    """
    plan, network = _cache_plan(kind, scenes), PRESETS[preset]
    if not network.square:
        return plan
    side = round(network.native_area**0.5)
    return replace(plan, with_tokens=False, sizes=((side, side),))


def _cache_plan(kind: str, scenes: int) -> CachePlan:
    if kind == "train":
        return CachePlan(0, scenes)
    judged = CachePlan(
        VALIDATION_SEED, scenes, libraries=VALIDATION_LIBRARIES, augment=False, three_view_every=1
    )
    if kind == "validation":
        return judged
    if kind == "held_out":
        return replace(judged, first_seed=HELD_OUT_SEED, libraries=HELD_OUT_LIBRARIES, with_tokens=False)
    raise InputError(f"there is no set '{kind}'; choose one of {', '.join(SETS)}")


def set_rooms(
    pack: Pack, renderer: RoomRenderer, kind: str, count: int, *, times: int = 1
) -> Iterator[StagedRoom]:
    """Rooms of a set, made again from their seeds: the same photos, `times` as large.

    Args:
        kind: "held_out" or "validation".
    """
    plan = cache_plan(kind, count)
    for shard in plan.shards():
        size = (times * shard.size[1], times * shard.size[0])
        for seed in range(shard.first_seed, shard.first_seed + shard.count):
            yield staged_room(
                seed, pack, renderer, num_views=shard.views, size=size, libraries=plan.libraries
            )


def run_cache(
    out: Path,
    pack: Path,
    start: Path | None,
    *,
    kind: str = "train",
    scenes: int = 4096,
    part: tuple[int, int] = (0, 1),
    preset: str = "mini",
) -> int:
    """Render and encode one set into `out/<kind>`; returns the number of scenes written.

    Single-threaded: run one process per core with `part` (i, n). Interrupted runs continue.

    Args:
        pack: furniture (`langflash lab rooms pack`).
        start: weights file of the preset, whose encoder is used; None where the cache keeps no tokens.
    """
    torch.set_num_threads(1)
    plan = cache_plan(kind, scenes, preset)
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


def run_recipe(
    recipe: Recipe,
    folder: Path,
    run_dir: Path,
    start: Path | None,
    encode: Encode,
    *,
    from_scratch: bool = False,
    scenes: SceneSource | None = None,
    outlined: Sequence[PhotoFolder] = (),
    sam: Path | None = None,
    sam_side: int = SIDE,
) -> LangFlashNet:
    """Train the stages of a recipe one after the other, each for its minutes, on the cached sets in `folder`.

    Earlier stages are read from `run_dir`; a stage found there continues unless its options say otherwise.
    Returns the network with every stage trained so far.

    Args:
        start: weights file of the preset. Its frozen parts are used, and stages without a run of
            their own begin with its heads, as far as these still fit the network. None: what is imported
            for a preset that nothing is shipped for.
        from_scratch: draw the heads anew instead.
        scenes: what grouping and aggregation learn from instead of rooms; `folder` then keeps phrases and
            what frozen networks say. outlined: photos with outlines or names, of which grouping learns from
            those that `split` does not keep, beside rooms. sam: weights of MobileSAM, for stages that
            regress its embedding; these see views whose longer side is `sam_side` pixels.
    """
    if scenes is None:
        _open(folder / "train")
    table = phrase_table(folder, encode) if scenes is None else _table(folder, scenes.labels, encode)
    network, done = prepared(recipe, run_dir, start, from_scratch=from_scratch)
    known = stages_of(recipe.preset)
    for plan in recipe.plans:
        stage, options = taught(plan.stage, network), plan.options
        missing = [need for need in stage.needs if need not in done]
        if missing:
            raise InputError(
                f"stage '{stage.name}' reads {', '.join(missing)}; train that first with the same run folder"
            )
        seed = options.seed + 1000 * list(known).index(stage.name) + done.get(stage.name, 0)
        words = Words(PhraseSampler(table), torch.Generator().manual_seed(seed))
        learned = _learned(stage, folder, outlined) if scenes is None else _drawn(stage, scenes, network)
        if not network.caches_tokens and not {"encoder", "decoder"} & set(stage.modules):
            reads_features = stage.name == "aggregation"
            learned = FrozenSet.of(learned, network, folder / "frozen", features=reads_features)
        if stage.dense:
            learned = DenseSet(learned, _sam(sam, sam_side, options), folder / "sam")
        if isinstance(learned, PartSet) and stage.name not in done:
            namer = guided(network).namer
            namer.mean, namer.std = learned.statistics()
        check = _validator(stage, folder, table, options) if scenes is None else None
        state = train_stage(network, stage, learned, words, run_dir, options, check)
        untaught(network)
        done[stage.name] = state.step
    return network.eval()


@dataclass(frozen=True)
class PhotoRun:
    """What learning from labelled photos is given, beside rooms.

    cache: of rooms. ids: of the photos to learn from; kept: of those to judge by now and then. start: weights
    file that the run begins with. more: other sets, labelled, in part or not at all.
    """

    cache: Path
    photos: PhotoFolder
    ids: Sequence[str]
    kept: Sequence[str]
    run_dir: Path
    start: Path
    encode: Encode
    options: LoopOptions
    more: Sequence[PhotoFolder] = ()
    preset: str = "mini"

    def rooms(self) -> RoomSet:
        """Those to learn from.

        Raises:
            InputError: there are none.
        """
        return _open(self.cache / "train")

    def network(self) -> LangFlashNet:
        """What learns, as the run begins."""
        network = initial_network(PRESETS[self.preset], self.start, self.options.seed)
        begin(network, self.start, ())
        return network

    def sets(self) -> Sets:
        return Sets.of(self.photos, self.ids, self.more, self.encode)

    def phrases(self) -> PhraseTable:
        return phrase_table(self.cache, self.encode)


def run_late(given: PhotoRun, *, names: bool = False) -> LoopState:
    """Train the late halves, and the heads that read them, on labelled photos and the cached rooms.

    With other sets the late halves go on from what the weights have instead of beginning anew (`fewlabels`).

    Args:
        names: nothing is learned of depth.

    Raises:
        InputError: no cache, or a photo cannot be used.
    """
    photos, kept, encode, options = given.photos, given.kept, given.encode, given.options
    rooms, network, table = given.rooms(), given.network(), given.phrases()
    if given.more:
        judge = judge_of(photos, kept, encode, options.device) if kept else None
        rooms.tokens = False  # of the frozen half alone, which is run with the others
        weights = NAMES_ALONE if names else None
        return train_few(network, given.sets(), rooms, table, given.run_dir, options, judge, weights)
    live = LivePhotos(photos, given.ids)
    words = Words(PhraseSampler(table), torch.Generator().manual_seed(options.seed))
    targets = PhotoTargets.of(photos, live, encode)
    check = KeptPhotos(LivePhotos(photos, kept), targets, options.device) if kept else None
    return train_late(network, targets, JointSet(live, rooms), words, given.run_dir, options, check)


def run_second(
    given: PhotoRun,
    *,
    weights: Mapping[str, Tensor] | None = None,
    scores: tuple[Tensor, Tensor] | None = None,
) -> LoopState:
    """Train what reads the other networks' maps, on labelled photos and the cached rooms.

    Args:
        weights: of the other networks (`OtherEyes`); None: those that the run begins with. scores: weight and
            bias of the layer that scores DeepLab's own names (`read_scores`), which then teach besides.

    Raises:
        InputError: no cache, no other networks, or a photo cannot be used.
    """
    rooms, network = given.rooms(), guided(given.network())
    rooms.tokens = False
    if weights is not None:
        network.others.load_state_dict(weights)
    if not bool(network.others.deeplab.stem.weight.any()):
        raise InputError(f"{given.start} holds no other networks; give both with --weights")
    learned = given.sets().named()
    judged = (
        PhotoPool((PhotoSet.of(given.photos, given.kept, 1.0),), (0,), learned.bank) if given.kept else None
    )
    scored = None if scores is None else Scored(*scores, given.encode(NAMES[1:]))
    return train_second(
        network, learned, judged, rooms, given.phrases(), given.run_dir, given.options, scored
    )


def _open(folder: Path, limit: int | None = None, *, photos: bool = False) -> RoomSet:
    try:
        return RoomSet(folder, limit=limit, partly=photos)
    except ValueError as error:
        raise InputError(str(error)) from None


def _photos(folder: Path, part: str) -> Path | None:
    """Where `train cache --photos` puts a part; None if nothing is there."""
    place = folder / "photos" / part
    return place if place.is_dir() else None


def _learned(
    stage: Stage, folder: Path, outlined: Sequence[PhotoFolder] = ()
) -> RoomSet | MixedSet | PartSet:
    """What a stage learns from: rooms, and photos where some are cached and the stage can use them; grouping
    from outlined ones instead, where there are any."""
    if stage.name == NAMING.name:
        return _parts(folder, "train")
    rooms, photos = _open(folder / "train"), _photos(folder, "train")
    if outlined and stage.name == "grouping":
        rooms.tokens = False  # photos have none: both are encoded as they come
        return MixedSet(rooms, outlined_set(outlined), stage.photos)
    if stage.photos == 0 or photos is None:
        return rooms
    return MixedSet(rooms, _open(photos, photos=True), stage.photos)


def _sam(weights: Path | None, side: int, options: LoopOptions) -> MobileSamEncoder:
    if weights is None:
        raise InputError(
            "this stage regresses SAM's embedding; name weights of MobileSAM with --sam-teacher, or give the "
            "recipe a teacher of 0"
        )
    return load_mobile_sam_encoder(weights, side, options.device)


def _drawn(stage: Stage, scenes: SceneSource, network: LangFlashNet) -> SceneSet:
    """Posed scenes, for a stage that can learn from them.

    Raises:
        InputError: it cannot.
    """
    if stage.name not in ("grouping", "aggregation"):
        raise InputError(f"stage '{stage.name}' does not learn from --scenes; name grouping and aggregation")
    return SceneSet(scenes, network.preset)


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
    done = load_trained(network, run_dir) if run_dir is not None else {}
    begin(network, start, done)
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
    return _table(folder, [*labels, *extra], encode)


def _table(folder: Path, labels: Sequence[Label], encode: Encode) -> PhraseTable:
    """Every phrase of the labels, with embeddings that are kept in the folder."""
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

    table = build_table(labels, remembered)
    save_whole({"phrases": list(table.phrases), "embeddings": table.embeddings}, path)
    return table


def run_adopt(encoder: Path, local: Path, out: Path, *, preset: str = "mini") -> Path:
    """Make a file to start from out of published weights of the frozen parts (see NOTICE)."""
    adopt_frozen(PRESETS[preset], encoder, local, out)
    return out
