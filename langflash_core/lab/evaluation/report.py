"""`langflash lab eval report`: every set that is at hand, judged scene by scene, as sections of one report.

Each section is what the command of its name judges (`eval rooms`, `posed`, `photos-labelled`), with an
interval of every number, pictures, and a plot of speed against error. What is kept in the work folder is
not judged again, unless weights or options changed.
"""

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation import labelled, posed
from langflash_core.lab.evaluation.ablations import study
from langflash_core.lab.evaluation.ablations.tables import ablation_plots, ablation_tables
from langflash_core.lab.evaluation.ablations.tables import summary as ablation_summary
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.photo_tables import LABEL_LISTS, PHOTOS, POSED
from langflash_core.lab.evaluation.photo_tables import METHODS as PHOTO_METHODS
from langflash_core.lab.evaluation.posed import APART, PAIRS, chosen_triples, pair_tallies
from langflash_core.lab.evaluation.report_parts import (
    Gallery,
    Plot,
    Point,
    Section,
    Table,
    labels_table,
    measures_table,
)
from langflash_core.lab.evaluation.report_sharp import Tally as Sharp
from langflash_core.lab.evaluation.report_sharp import sharp_report_tables, sharp_summary, sharp_tallies
from langflash_core.lab.evaluation.report_sides import Tally as Sides
from langflash_core.lab.evaluation.report_sides import side_summary, side_tables, side_tallies
from langflash_core.lab.evaluation.rooms import run as rooms
from langflash_core.lab.evaluation.rooms.summary import summary as room_summary
from langflash_core.lab.evaluation.rooms.tally import Tally as RoomTally
from langflash_core.lab.evaluation.sharp import WAYS, Bench
from langflash_core.lab.evaluation.sharp_subjects import Subject, posed_subjects, room_subjects
from langflash_core.lab.evaluation.sights import Look
from langflash_core.lab.evaluation.speed import PAPER_MS
from langflash_core.lab.evaluation.tables import COLUMNS, MEASURES, METHODS
from langflash_core.lab.evaluation.tallies import Shelf, identity, intervals, merged
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
    """render: draws scenes; folder: where tallies and pictures are kept; weights, preset: as everywhere."""

    render: labelled.Render
    folder: Path
    weights: Path | None = None
    preset: str = "mini"
    progress: Progress = lambda stage, fraction: None
    lpips: Lpips | None = None

    def shelf(self, section: str, kind: type, **key: object) -> Shelf:
        key = {
            "weights": identity(self.weights, self.preset),
            "lpips": self.lpips and self.lpips.digest,
            **key,
        }
        return Shelf(self.folder / section, key, kind)


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


def rooms_section(data: Path, place: Workplace, limit: int | None = None) -> Section:
    """Furnished rooms whose furniture no training saw, every rival in the same run."""
    setting, held_out = rooms.open_rooms(
        data, place.weights, preset=place.preset, limit=limit, lpips=place.lpips
    )
    shelf = place.shelf("rooms", RoomTally, data=str(data.resolve()), groups=setting.groups)
    kept, gallery = _told(
        place, shelf, len(held_out), lambda look: rooms.room_tallies(setting, held_out, shelf, look)
    )
    result, bounds = _summed(kept, lambda tally: room_summary(tally, setting))
    seeds = sorted(map(int, kept))
    about = (
        f"{len(kept)} rooms, seeds {seeds[0]} to {seeds[-1]}, furniture held out from training; two photos "
        "make the scene, a third view judges it where a photo sees the surface."
    )
    columns = {column: column.replace("_", " ").replace("miou", "mIoU") for column in COLUMNS}
    return Section(
        "rooms",
        "Rooms",
        about,
        {"scenes": len(kept), **result},
        bounds,
        (
            measures_table("Measures", MEASURES, result["measures"], bounds),
            labels_table("Labels, every rival in the same run", METHODS, columns, result["labels"], bounds),
            _stage_table(result["measures"]),
        ),
        _room_plots(result, bounds),
        gallery.shown(list(kept), WORST, BEST),
    )


def ablations_section(data: Path, place: Workplace, limit: int | None = None) -> Section:
    """Which part of the method pays, on some of the rooms."""
    shelf = place.shelf("ablations", study.Tally, data=str(data.resolve()))
    setting, count, studies = study.room_studies(
        data,
        place.weights,
        limit=limit,
        most=ABLATED,
        shelf=shelf,
        progress=place.progress,
    )
    kept, _ = _told(place, shelf, count, lambda look: studies)
    result, bounds = _summed(kept, ablation_summary)
    about = (
        f"{len(kept)} of the rooms, taken evenly; {len(setting.groups)} class groups. All rivals draw "
        "the same Gaussians from the same camera by the same rasteriser; times are of drawing and decoding, "
        'in one process, and "x atoms" is the mean over rooms of the ratio to the atoms in the same room.'
    )
    return Section(
        "ablations",
        "What pays: groups, vectors, K, and rivals",
        about,
        {"scenes": len(kept), **result},
        bounds,
        ablation_tables(result),
        ablation_plots(result, bounds),
    )


def sides_section(pack: Path, place: Workplace, limit: int | None = None) -> Section:
    """Rooms seen from aside."""
    count = min(limit or SIDES, SIDES)
    shelf = place.shelf("sides", Sides, pack=str(pack.resolve()))
    kept, _ = _told(
        place,
        shelf,
        count,
        lambda look: side_tallies(
            pack, count, place.render, place.weights, preset=place.preset, lpips=place.lpips, shelf=shelf
        ),
    )
    result, bounds = _summed(kept, side_summary)
    return Section(
        "sides",
        "Rooms seen from aside",
        f"{len(kept)} rooms, drawn from 10 to 45 degrees aside and from over and under.",
        {"scenes": len(kept), **result},
        bounds,
        side_tables(result),
    )


def sharp_rooms_section(pack: Path, place: Workplace, limit: int | None = None) -> Section:
    """Rooms at the size of photos."""
    count = min(limit or SHARP, SHARP)

    def subjects() -> Iterator[Subject]:
        furniture = load_pack(pack)
        with RoomRenderer(furniture) as renderer:
            yield from room_subjects(furniture, renderer, count=count)

    shelf = place.shelf("sharp_rooms", Sharp, pack=str(pack.resolve()), ways=WAYS)
    return _sharp_section("Rooms at the photos' size", subjects(), count, place, shelf)


def sharp_posed_section(folder: PhotoFolder, place: Workplace, limit: int | None = None) -> Section:
    """Pairs of real photos at their own size."""
    triples = chosen_triples(folder.ids, min(limit or SHARP, SHARP), APART)
    shelf = place.shelf("sharp_posed", Sharp, **_described(folder), ways=WAYS)
    subjects = posed_subjects(folder, triples)
    return _sharp_section("Real photos at their own size", subjects, len(triples), place, shelf)


def _sharp_section(
    title: str, subjects: Iterator[Subject], count: int, place: Workplace, shelf: Shelf
) -> Section:
    bench = Bench(place.render, place.weights, place.preset, ways=WAYS, lpips=place.lpips)
    kept, gallery = _told(place, shelf, count, lambda look: sharp_tallies(subjects, bench, shelf, look))
    result, bounds = _summed(kept, sharp_summary)
    about = (
        f"{len(kept)} pairs; each scene is drawn from its photos' own places, and from that of a kept one "
        "between, at their size, at most three times the network's grid, beside the photo through that grid."
    )
    return Section(
        shelf.folder.name,
        title,
        about,
        {"scenes": len(kept), **result},
        bounds,
        sharp_report_tables(result),
        (),
        gallery.shown(list(kept), WORST, BEST),
    )


def posed_section(folder: PhotoFolder, place: Workplace, limit: int | None = None) -> Section:
    """Pairs of real photos whose poses somebody measured."""
    triples = chosen_triples(folder.ids, limit or PAIRS, APART)
    shelf = place.shelf("posed", posed.Tally, **_described(folder))
    kept, gallery = _told(
        place,
        shelf,
        len(triples),
        lambda look: pair_tallies(
            folder,
            triples,
            place.render,
            place.weights,
            preset=place.preset,
            lpips=place.lpips,
            align=True,
            shelf=shelf,
            look=look,
        ),
    )
    result, bounds = _summed(kept, lambda tally: {"measures": posed.summary(tally)})
    about = (
        f"{len(kept)} pairs of {folder.root.name}, {', '.join(map(str, APART))} numbers apart; the photo "
        "half-way between is drawn from its true place."
    )
    return Section(
        "posed",
        "Real photos of known poses",
        about,
        {"scenes": len(kept), **result},
        bounds,
        (measures_table("Measures", POSED, result["measures"], bounds),),
        (),
        gallery.shown(list(kept), WORST, BEST),
    )


def photos_section(folder: PhotoFolder, ids: Sequence[str], place: Workplace) -> Section:
    """Single real photos that somebody labelled."""
    judged = labelled.judged_by(folder, place.render, place.weights, preset=place.preset)
    shelf = place.shelf("photos", labelled.Tally, **_described(folder), words=len(judged.words.phrases))
    kept, gallery = _told(
        place, shelf, len(ids), lambda look: labelled.photo_tallies(judged, folder, ids, shelf, look)
    )
    result, bounds = _summed(kept, lambda tally: labelled.summary(tally, judged.words))
    columns = {
        f"{kind}_{what}": f"{text}: {name}"
        for kind, text in LABEL_LISTS.items()
        for what, name in (("miou", "mIoU"), ("accuracy", "accuracy"))
    }
    return Section(
        "photos",
        "Real photos with labels",
        f"{len(kept)} photos of {folder.root.name}, each reconstructed alone and asked as anybody would ask.",
        {"scenes": len(kept), **result},
        bounds,
        (
            measures_table("Measures", PHOTOS, result["measures"], bounds),
            labels_table("Labels", PHOTO_METHODS, columns, result["labels"], bounds),
        ),
        (),
        gallery.shown(list(kept), WORST, BEST),
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


def _told(
    place: Workplace, shelf: Shelf, count: int, run: Callable[[Look], Iterator[tuple[str, Any]]]
) -> tuple[dict[str, Any], Gallery]:
    """Tallies by name as they come, with progress, and the gallery of their sights."""
    section = shelf.folder.name
    gallery = Gallery(shelf.folder / "pictures")
    kept: dict[str, Any] = {}
    place.progress(section, 0.0)
    for name, tally in run(gallery.add):
        kept[name] = tally
        place.progress(f"{section}: {name}, {len(kept)} of {count}", len(kept) / max(count, 1))
    if not kept:
        raise InputError(f"no scene of the section {section} was judged; give a source that holds some")
    return kept, gallery


def _summed(
    kept: Mapping[str, Any], summary: Callable[[Any], Mapping[str, Any]]
) -> tuple[dict[str, Any], dict[str, list[float] | None]]:
    tallies = list(kept.values())
    return dict(summary(merged(tallies))), intervals(tallies, summary, draws=DRAWS)


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
