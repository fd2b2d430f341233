"""`langflash lab eval report`: every set that is at hand, judged scene by scene, as sections of one report.

Each section is what the command of its name judges (`eval rooms`, `posed`, `photos-labelled`), with an
interval of every number, pictures, and a plot of speed against error. What is kept in the work folder is
not judged again, unless weights or options changed.
"""

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from langflash_core.base.running import Progress
from langflash_core.lab.evaluation import labelled, posed, sharp, sides
from langflash_core.lab.evaluation.ablations import study
from langflash_core.lab.evaluation.ablations.tables import ablation_plots, ablation_tables
from langflash_core.lab.evaluation.ablations.tables import summary as ablation_summary
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.posed import APART, PAIRS, chosen_triples
from langflash_core.lab.evaluation.report_parts import Gallery, Plot, Point, Section
from langflash_core.lab.evaluation.rooms import run as rooms
from langflash_core.lab.evaluation.rooms.summary import COLUMNS, MEASURES, METHODS
from langflash_core.lab.evaluation.rooms.summary import summary as room_summary
from langflash_core.lab.evaluation.rooms.tally import Tally as RoomTally
from langflash_core.lab.evaluation.sharp_subjects import Subject, posed_subjects, room_subjects
from langflash_core.lab.evaluation.side_subjects import Case, room_cases
from langflash_core.lab.evaluation.sights import Look
from langflash_core.lab.evaluation.speed import PAPER_MS
from langflash_core.lab.evaluation.tables import Intervals, Table, labels_table, measures_table
from langflash_core.lab.evaluation.tallies import Rows, Shelf, identity, intervals, judged, merged
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.rooms import RoomRenderer, load_pack

WORST, BEST = 6, 2
"""Scenes shown of a section."""
DRAWS = 300
ABLATED, SIDES, SHARP = 25, 24, 8
"""At most so many rooms are asked of every rival, so many walked around, and so many scenes of rooms and of
pairs compared with their photos at the photos' size."""
PUBLISHED = Table(
    "",
    ("system", "data", "measure", "value"),
    (
        ("LangFlash (Liu et al. 2026), main table", "ScanNet, 40 scenes", "mIoU, accuracy", "0.7416, 0.8718"),
        ("LangFlash, table of K, K = 128", "ScanNet, 40 scenes", "mIoU, accuracy", "0.7144, 0.8547"),
        ("EPS3D (arXiv 2606.08980)", "as published", "panoptic quality, instance mIoU", "0.530, 0.42"),
        ("Instok3D (arXiv 2606.29513), one vector a group", "ScanNet", "mIoU", "0.635"),
        ("Instok3D, plus 8 residual channels", "ScanNet", "mIoU", "0.657"),
        *(
            (f"LangFlash: {stage}", "2 photos of 256 x 256, unnamed GPU", "ms", f"{ms:g}")
            for stage, ms in PAPER_MS.items()
        ),
    ),
)
"""What papers say of themselves, on data that is not here; `eval protocol` judges on theirs."""


@dataclass(frozen=True)
class Sources:
    """What is at hand: a cache of rooms, a furniture pack to walk around rooms, posed and labelled photos
    (None: not there). photo_ids: none means all; limit: rooms, and pairs of posed photos."""

    rooms: Path | None = None
    pack: Path | None = None
    posed: PhotoFolder | None = None
    photos: PhotoFolder | None = None
    photo_ids: Sequence[str] = ()
    limit: int | None = None


@dataclass(frozen=True)
class Workplace:
    """bench: makes and draws scenes; folder: where tallies and pictures are kept."""

    bench: Bench
    folder: Path
    progress: Progress = lambda stage, fraction: None

    def shelf(self, section: str, kind: type, **key: object) -> Shelf:
        weights = identity(self.bench.weights, self.bench.preset)
        known = {"weights": weights, "lpips": self.bench.lpips and self.bench.lpips.digest}
        return Shelf(self.folder / section, {**known, **key}, kind)


def plans(sources: Sources) -> list[Callable[[Workplace], Section]]:
    """What judges each source, in the order of the report. A judge may raise InputError: its source cannot
    be used, or WeightsError: of the checkpoint."""
    cache, pack, pairs, photos = sources.rooms, sources.pack, sources.posed, sources.photos
    limit = sources.limit
    judges: list[Callable[[Workplace], Section]] = []
    if cache is not None:
        judges.append(lambda place: rooms_section(cache, place, limit))
        if (cache / "train").is_dir():
            judges.append(lambda place: ablations_section(cache, place, limit))
    if pack is not None:
        judges.append(lambda place: sides_section(pack, place, limit))
        judges.append(lambda place: sharp_rooms_section(pack, place, limit))
    if pairs is not None:
        judges.append(lambda place: posed_section(pairs, place, limit))
        judges.append(lambda place: sharp_posed_section(pairs, place, limit))
    if photos is not None:
        judges.append(lambda place: photos_section(photos, sources.photo_ids or photos.ids, place))
    return judges


def section_of(
    place: Workplace,
    shelf: Shelf,
    title: str,
    about: Callable[[Sequence[str]], str],
    cases: Iterable[tuple[str, Any]],
    count: int,
    judge: Callable[[Any, Look], Any],
    summary: Callable[[Any], Mapping[str, Any]],
    tables: Callable[[dict, Intervals], Sequence[Table]],
    plots: Callable[[dict, Intervals], Sequence[Plot]] = lambda result, bounds: (),
) -> Section:
    """Cases judged into a section of the shelf's name.

    Args:
        about: what is said of cases of these names.
        judge: of a case, with whom to show a picture of it.
    """
    gallery, name = Gallery(shelf.folder / "pictures"), shelf.folder.name
    kept = judged(
        cases,
        lambda case, _: judge(case, gallery.add),
        count=count,
        shelf=shelf,
        progress=lambda stage, fraction: place.progress(f"{name}: {stage}", fraction),
    )
    tallies, names = list(kept.values()), list(kept)
    result = {"scenes": len(kept), **summary(merged(tallies))}
    bounds = intervals(tallies, summary, draws=DRAWS)
    return Section(
        name,
        title,
        about(names),
        result,
        bounds,
        tables(result, bounds),
        plots(result, bounds),
        gallery.shown(names, WORST, BEST),
    )


def rooms_section(data: Path, place: Workplace, limit: int | None = None) -> Section:
    """Furnished rooms whose furniture no training saw, every rival in the same run."""
    bench = place.bench
    setting, held_out = rooms.open_rooms(
        data, bench.weights, preset=bench.preset, limit=limit, lpips=bench.lpips
    )

    def tables(result: dict, bounds: Intervals) -> list[Table]:
        title = "Labels, every rival in the same run"
        return [
            measures_table("Measures", MEASURES, result["measures"], bounds),
            labels_table(title, METHODS, COLUMNS, result["labels"], bounds),
            _stage_table(result["measures"]),
        ]

    return section_of(
        place,
        place.shelf("rooms", RoomTally, data=str(data.resolve()), groups=setting.groups),
        "Rooms",
        lambda names: (
            f"{len(names)} rooms, seeds {names[0]} to {names[-1]}, furniture held out from training; two "
            "photos make the scene, a third view judges it where a photo sees the surface."
        ),
        rooms.named_records(held_out),
        len(held_out),
        lambda record, look: rooms.judge(setting, record, look),
        lambda tally: room_summary(tally, setting),
        tables,
        _room_plots,
    )


def ablations_section(data: Path, place: Workplace, limit: int | None = None) -> Section:
    """Which part of the method pays, on some of the rooms."""
    shelf = place.shelf("ablations", study.Tally, data=str(data.resolve()))
    setting, fits, count, cases = study.opened_study(
        data, place.bench.weights, limit=limit, most=ABLATED, shelf=shelf, progress=place.progress
    )
    return section_of(
        place,
        study.grouped_shelf(shelf, setting),
        "What pays: groups, vectors, K, and rivals",
        lambda names: (
            f"{len(names)} of the rooms, taken evenly; {len(setting.groups)} class groups. All rivals draw "
            "the same Gaussians from the same camera by the same rasteriser; times are of drawing and "
            'decoding, in one process, and "x atoms" is the mean over rooms of the ratio to the atoms in the '
            "same room."
        ),
        cases,
        count,
        lambda record, look: study.judge(setting, fits, record),
        ablation_summary,
        lambda result, bounds: ablation_tables(result),
        ablation_plots,
    )


def sides_section(pack: Path, place: Workplace, limit: int | None = None) -> Section:
    """Rooms seen from aside."""
    count = min(limit or SIDES, SIDES)

    def cases() -> Iterator[tuple[str, Case]]:
        furniture = load_pack(pack)
        with RoomRenderer(furniture) as renderer:
            yield from ((case.name, case) for case in room_cases(furniture, renderer, count=count))

    return section_of(
        place,
        place.shelf("sides", Rows, pack=str(pack.resolve())),
        "Rooms seen from aside",
        lambda names: f"{len(names)} rooms, drawn from 10 to 45 degrees aside and from over and under.",
        cases(),
        count,
        lambda case, look: Rows([sides.judge(case, place.bench)]),
        lambda tally: sides.summary(tally.rows),
        lambda result, bounds: sides.tables(result),
    )


def sharp_rooms_section(pack: Path, place: Workplace, limit: int | None = None) -> Section:
    """Rooms at the size of photos."""
    count = min(limit or SHARP, SHARP)

    def subjects() -> Iterator[Subject]:
        furniture = load_pack(pack)
        with RoomRenderer(furniture) as renderer:
            yield from room_subjects(furniture, renderer, count=count)

    shelf = place.shelf("sharp_rooms", Rows, pack=str(pack.resolve()), ways=sharp.WAYS)
    return _sharp_section("Rooms at the photos' size", subjects(), count, place, shelf)


def sharp_posed_section(folder: PhotoFolder, place: Workplace, limit: int | None = None) -> Section:
    """Pairs of real photos at their own size."""
    triples = chosen_triples(folder.ids, min(limit or SHARP, SHARP), APART)
    shelf = place.shelf("sharp_posed", Rows, **_described(folder), ways=sharp.WAYS)
    subjects = posed_subjects(folder, triples)
    return _sharp_section("Real photos at their own size", subjects, len(triples), place, shelf)


def _sharp_section(
    title: str, subjects: Iterator[Subject], count: int, place: Workplace, shelf: Shelf
) -> Section:
    own = place.bench
    bench = sharp.Bench(own.render, own.weights, own.preset, lpips=own.lpips)
    return section_of(
        place,
        shelf,
        title,
        lambda names: (
            f"{len(names)} pairs; each scene is drawn from its photos' own places, and from that of a kept "
            "one between, at their size, at most three times the network's grid, beside the photo through "
            "that grid."
        ),
        ((subject.name, subject) for subject in subjects),
        count,
        lambda subject, look: Rows([sharp.judge(subject, bench, look)]),
        lambda tally: {"measures": sharp.summary(tally.rows)},
        lambda result, bounds: [table for table in sharp.tables(result) if table.rows],
    )


def posed_section(folder: PhotoFolder, place: Workplace, limit: int | None = None) -> Section:
    """Pairs of real photos whose poses somebody measured."""
    triples = chosen_triples(folder.ids, limit or PAIRS, APART)
    bench = replace(place.bench, align=True)
    return section_of(
        place,
        place.shelf("posed", posed.Tally, **_described(folder)),
        "Real photos of known poses",
        lambda names: (
            f"{len(names)} pairs of {folder.root.name}, {', '.join(map(str, APART))} numbers apart; the "
            "photo half-way between is drawn from its true place."
        ),
        ((triple.name, triple) for triple in triples),
        len(triples),
        lambda triple, look: posed.judge(folder, triple, bench, look),
        lambda tally: {"measures": posed.summary(tally)},
        lambda result, bounds: [measures_table("Measures", posed.MEASURES, result["measures"], bounds)],
    )


def photos_section(folder: PhotoFolder, ids: Sequence[str], place: Workplace) -> Section:
    """Single real photos that somebody labelled."""
    setting = labelled.Judged.of(folder, place.bench)
    words = len(setting.words.phrases)
    return section_of(
        place,
        place.shelf("photos", labelled.Tally, **_described(folder), words=words),
        "Real photos with labels",
        lambda names: (
            f"{len(names)} photos of {folder.root.name}, each reconstructed alone and asked as anybody would "
            "ask."
        ),
        ((id, id) for id in ids),
        len(ids),
        lambda id, look: labelled.judge(setting, folder.photo(id), look),
        lambda tally: labelled.summary(tally, setting.words),
        lambda result, bounds: [
            measures_table("Measures", labelled.MEASURES, result["measures"], bounds),
            labels_table("Labels", labelled.METHODS, labelled.COLUMNS, result["labels"], bounds),
        ],
    )


def _described(folder: PhotoFolder) -> dict[str, object]:
    """What photos are judged by besides their pixels: with another crop or lens they are judged anew."""
    Ks, poses = (
        None if known is None else {id: matrix.tolist() for id, matrix in known.items()}
        for known in (folder.Ks, folder.poses)
    )
    said = repr((folder.crop, folder.depth_unit, folder.names, Ks, poses))
    return {
        "folder": str(folder.root.resolve()),
        "described": hashlib.sha256(said.encode()).hexdigest()[:16],
    }


def _stages(measures: Mapping[str, float | None]) -> dict[str, float]:
    """Mean seconds of the network's stages, in order of what they take."""
    found = {
        name.removeprefix("stage_").removesuffix("_seconds"): value
        for name, value in measures.items()
        if name.startswith("stage_") and value is not None
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _stage_table(measures: Mapping[str, float | None]) -> Table:
    rows = [(name, f"{1000 * value:,.0f}") for name, value in _stages(measures).items()]
    return Table("Seconds by stage of the network", ("stage, two photos", "ms, mean"), rows)


def _room_plots(result: Mapping[str, Any], bounds: Mapping[str, Sequence[float] | None]) -> tuple[Plot, ...]:
    """Ways to name what a new view shows: what the stages take that each needs, and how wrong it is."""
    stages = _stages(result["measures"])
    whole = sum(stages.values())
    needed = {
        "features": stages.get("encoder", 0.0) + stages.get("language features", 0.0),
        "averaged": whole - stages.get("aggregation", 0.0),
        "lfa": whole,
    }
    points = []
    for method, seconds in needed.items():
        error = result["labels"].get(method, {}).get("target_groups_miou")
        if error is None or seconds <= 0:
            continue
        around = bounds.get(f"labels/{method}/target_groups_miou")
        flipped = None if around is None else [1 - around[1], 1 - around[0]]
        points.append(Point(METHODS[method], seconds, 1 - error, flipped))
    if not points or math.isclose(whole, 0):
        return ()
    return (
        Plot(
            "Speed against error: names in a new view",
            "seconds for two photos, network alone (2D features: the new view's own photo)",
            "1 - mIoU over class groups",
            points,
        ),
    )
