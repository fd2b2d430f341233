"""Going on from taught weights, with other sets of photos beside the labelled ones: `train late --more`
and `train second`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.lab.photos import PhotoFolder, chosen_ids
from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.fewlabels import Averaged, FewSet, Weights, few_stage
from langflash_core.lab.training.heard import counted, evidence
from langflash_core.lab.training.late import make_cut, make_whole
from langflash_core.lab.training.live import LivePhotos, pictures
from langflash_core.lab.training.loop import LoopOptions, Optimising, train_stage
from langflash_core.lab.training.pool import WHOLE, PhotoPool, PhotoSet, labelled_share
from langflash_core.lab.training.real import MODULES, KeptPhotos, PhotoTargets
from langflash_core.lab.training.second import KeptPixels, PixelSet, Scored, room_pixels, second_stage
from langflash_core.lab.training.stages.stage import Words, guided
from langflash_core.lab.training.states import LoopState, save_cut
from langflash_core.lab.training.words import PhraseSampler, PhraseTable
from langflash_core.network.model import LangFlashNet

MAIN_SHARE = 0.65
"""Of the labelled photos of a step, those of the judged set; other labelled sets share the rest."""
LEARNED = 0.5
"""Of the way from the weights that a run begins with to those it ends with (model card); all of it
where another network is heard, since nothing is lost then (MEASURED.md)."""
EMA_DECAY = 0.995
"""Of the averaged weights that a run ends with."""
WARM_UP = 20


@dataclass(frozen=True)
class Sets:
    """All photos that are learned from; which of them are labelled, and which mostly not."""

    told: PhotoPool
    silent: PhotoPool | None

    @staticmethod
    def of(
        main: PhotoFolder,
        ids: Sequence[str],
        more: Sequence[PhotoFolder],
        encode: Callable[[Sequence[str]], Tensor],
    ) -> "Sets":
        """Of each further folder what `split` does not keep is learned from.

        Raises:
            InputError: a photo or its labels cannot be used.
        """
        first = PhotoSet.of(main, ids, MAIN_SHARE, hold=True)
        others = [PhotoSet.of(folder, chosen_ids(folder.ids, "train"), 1.0) for folder in more]
        heard = counted(main.names, first.held)
        said = evidence(heard) if bool(heard.any()) else None
        bank = NameBank.of([one.named for one in (first, *others)], encode, said)
        labelled = [place for place, one in enumerate(others) if labelled_share(one) >= WHOLE]
        rest = [place for place in range(len(others)) if place not in labelled]
        photos = sum(len(others[place].ids) for place in labelled)
        shares = [(1 - MAIN_SHARE) * len(others[place].ids) / photos for place in labelled]
        told = [replace(others[place], share=share) for place, share in zip(labelled, shares, strict=True)]
        silent = [replace(others[place], share=len(others[place].ids) ** 0.5) for place in rest]
        return Sets(
            PhotoPool((first, *told), (0, *(place + 1 for place in labelled)), bank),
            PhotoPool(tuple(silent), tuple(place + 1 for place in rest), bank, strong=True) if rest else None,
        )

    def named(self) -> PhotoPool:
        """Those that name anything."""
        silent = self.silent or PhotoPool((), (), self.told.bank)
        pairs = zip((*self.told.sets, *silent.sets), self.told.numbers + silent.numbers, strict=True)
        named = [(one, number) for one, number in pairs if one.folder.labelled]
        sets, numbers = zip(*named, strict=True)
        return PhotoPool(sets, numbers, self.told.bank)


def train_few(
    network: LangFlashNet,
    sets: Sets,
    rooms: RoomSet | None,
    table: PhraseTable,
    run_dir: Path,
    options: LoopOptions,
    kept: KeptPhotos | None = None,
    weights: Weights | None = None,
) -> LoopState:
    """Train whole late blocks and what reads them, go back a part of the way, and cut the blocks:
    `RUN/late.pt` is what later stages and `train export` read, `RUN/late_few.pt` what a run goes on from.

    Source: Wortsman et al. 2022 (WiSE-FT: weights between those before and after hold better).
    """
    net = guided(network)
    make_whole(net)
    start = {name: value.clone() for name, value in net.state_dict().items() if _learns(name)}
    net.averaged = Averaged(net)  # type: ignore[assignment]
    words = Words(PhraseSampler(table), torch.Generator().manual_seed(options.seed))
    options = _steadily(options)
    stage = few_stage(sets.told.bank, weights)
    state = train_stage(net, stage, FewSet(sets.told, sets.silent, rooms), words, run_dir, options, kept)
    del net.averaged
    if sets.told.bank.evidence is None:
        _go_back(net, start)
    make_cut(net, pictures(sets.told.sets[0].held))
    save_cut(run_dir / "late.pt", net, replace(stage, name="late", modules=MODULES), state)
    return state


def train_second(
    network: LangFlashNet,
    photos: PhotoPool,
    kept: PhotoPool | None,
    rooms: RoomSet,
    table: PhraseTable,
    run_dir: Path,
    options: LoopOptions,
    scored: Scored | None = None,
) -> LoopState:
    """Train what reads the other networks' maps, from nothing, judged by `kept`: `RUN/second.pt`. rooms: it
    learns to tell them from photos. scored: what DeepLab's own scores say teaches besides.

    Raises:
        InputError: a photo cannot be used, or they teach nothing.
    """
    net = guided(network)
    with torch.random.fork_rng(devices=()):
        torch.manual_seed(options.seed)
        net.second_head.begin()
    words = Words(PhraseSampler(table), torch.Generator().manual_seed(options.seed))
    net.others.to(options.device)
    seen = room_pixels(net.others, rooms, words.generator)
    pixels = PixelSet.of(net.others, photos, words.generator, seen)
    pixels.check()
    judge = None if kept is None else KeptPixels(PixelSet.of(net.others, kept, words.generator), photos.bank)
    # What phrases are compared with is true of no pixel.
    stage = second_stage(photos.bank.denying(table.embeddings[table.baseline_rows()]), scored)
    return train_stage(net, stage, pixels, words, run_dir, options, judge)


@torch.no_grad()
def _go_back(network: LangFlashNet, start: Mapping[str, Tensor]) -> None:
    for name, value in network.state_dict().items():
        if _learns(name) and value.is_floating_point():
            value.lerp_(start[name].to(value), 1 - LEARNED)


def _steadily(options: LoopOptions) -> LoopOptions:
    """With averaged weights, and a short warm-up where nobody asked for another."""
    asked = options.optimising
    rule = replace(asked, warm_up=WARM_UP) if asked == Optimising() else asked
    return replace(options, ema_decay=EMA_DECAY, optimising=rule)


def _learns(name: str) -> bool:
    return name.partition(".")[0] in MODULES


def judge_of(
    folder: PhotoFolder, ids: Sequence[str], encode: Callable[[Sequence[str]], Tensor], device: str
) -> KeptPhotos:
    """Judges by photos that nothing learns from."""
    live = LivePhotos(folder, ids)
    return KeptPhotos(live, PhotoTargets.of(folder, live, encode), device)
