"""Which photos of a published data set make a scene, what is asked of it, and which views are judged.

A protocol reads a data set where it lies (`photos.published`) and gives cases; `cases` judges them. What a
protocol leaves open, or what here differs from it, is said in its `about`.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.posed import APART, PAIRS, chosen_triples
from langflash_core.lab.evaluation.words import OTHER, PAPER_LABELS
from langflash_core.lab.photos import Name, PhotoFolder
from langflash_core.lab.photos.published import (
    open_frames,
    open_masked,
    open_scannet,
    re10k_scenes,
    scannet_names,
)
from langflash_core.lab.photos.reading import read_table

HELD, TESTED = 8, (1, 4)
"""ScanNet: of every so many sampled frames, these are targets."""
RE10K_INDEX = "evaluation_index_re10k.json"


@dataclass(frozen=True)
class Case:
    """One reconstruction: ids of the photos that the network gets, and of views kept back.

    scene: cases of one scene are alike, so intervals draw scenes. labels: what is asked, none where
    nothing is labelled; rows: id of the folder -> place in `labels`, -1 = not judged.
    """

    name: str
    scene: str
    folder: PhotoFolder
    photos: tuple[str, ...]
    targets: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    rows: Mapping[int, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Cases in order, and how many there are (None: not known before they are read)."""

    cases: Iterator[Case]
    count: int | None = None


@dataclass(frozen=True)
class Protocol:
    """title, about: for people. get: where the data set comes from, one sentence. plan: of a folder, with
    an evaluation index where the protocol has one."""

    title: str
    about: str
    get: str
    plan: Callable[[Path, Path | None], Plan]


def planned(name: str, root: Path, index: Path | None = None) -> Plan:
    """The cases of a protocol.

    Raises:
        InputError: there is no such protocol, or the folder is missing or of another layout; the message
            says how to get the data set.
    """
    if name not in PROTOCOLS:
        raise InputError(f"there is no protocol '{name}'; choose one of {', '.join(PROTOCOLS)}")
    if not root.is_dir():
        raise InputError(f"there is no folder {root}; {PROTOCOLS[name].get}")
    return PROTOCOLS[name].plan(root, index)


def scannet_rows(names: Mapping[int, Name]) -> dict[int, int]:
    """Row of the eight labels of every id: a class of forty of the same name, or "other"."""
    return {
        id: PAPER_LABELS.index(name.label) if name.label in PAPER_LABELS else OTHER
        for id, name in names.items()
    }


def scannet_views(count: int) -> list[tuple[int, int, int]]:
    """Places of (source, target, source) among `count` sampled frames, as LSM takes them: the neighbours of
    each target are the photos; one without two neighbours is no target."""
    return [(i - 1, i, i + 1) for i in range(1, count - 1) if i % HELD in TESTED]


def _scannet(root: Path, index: Path | None) -> Plan:
    names = scannet_names(root)
    table = index or root / "selected_seqs_test.json"
    chosen: Mapping[str, list] = read_table(table) if table.is_file() else {}
    listed = [s for s in chosen if chosen[s]] or [p.name for p in root.glob("scene*") if p.is_dir()]
    scenes = sorted(name for name in listed if (root / name).is_dir())
    if not scenes:
        raise InputError(f"{root} holds no scene; {PROTOCOLS['scannet'].get}")
    rows = scannet_rows(names)

    def cases() -> Iterator[Case]:
        for scene in scenes:
            folder = open_scannet(root / scene, names)
            wanted = [str(id) for id in sorted(chosen.get(scene, []))] or list(folder.ids)
            ids = [id for id in wanted if id in folder.ids]
            for one, target, other in scannet_views(len(ids)):
                yield Case(
                    f"{scene}-{ids[target]}",
                    scene,
                    folder,
                    tuple(dict.fromkeys((ids[one], ids[other]))),
                    (ids[target],),
                    PAPER_LABELS,
                    rows,
                )

    counts = [len(scannet_views(len(chosen[scene]))) for scene in scenes if scene in chosen]
    return Plan(cases(), sum(counts) if len(counts) == len(scenes) else None)


def _masked(root: Path, index: Path | None) -> Plan:
    scenes = [p.parent for p in sorted(root.glob("*/segmentations"))]
    if (root / "segmentations").is_dir():
        scenes = [root]
    if not scenes:
        raise InputError(f"{root} holds no scene with segmentations; {PROTOCOLS['3dovs'].get}")

    def cases() -> Iterator[Case]:
        for path in scenes:
            folder = open_masked(path)
            ids = sorted(folder.annotated, key=folder.ids.index)
            labels = tuple(folder.names[number].text for number in sorted(folder.names))
            rows = {number: row for row, number in enumerate(sorted(folder.names))}
            for place, id in enumerate(ids):
                other = ids[(place + 1) % len(ids)]
                pair = tuple(dict.fromkeys((id, other)))
                yield Case(f"{path.name}-{id}", path.name, folder, pair, (), labels, rows)

    return Plan(cases())


def _re10k(root: Path, index: Path | None) -> Plan:
    split = root if (root / "index.json").is_file() else root / "test"
    if not (split / "index.json").is_file():
        raise InputError(f"{root} holds no index.json; {PROTOCOLS['re10k'].get}")
    table = index or root / RE10K_INDEX
    if not table.is_file():
        raise InputError(
            f"there is no evaluation index {table}; name pixelSplat's assets/{RE10K_INDEX} with --index"
        )
    chosen = {key: entry for key, entry in read_table(table).items() if entry}
    known = read_table(split / "index.json")
    listed = {key: entry for key, entry in chosen.items() if key in known}
    if not listed:
        raise InputError(f"{table} names no scene of {split}; use index and chunks of one release")

    def cases() -> Iterator[Case]:
        for key, folder in re10k_scenes(split, listed):
            entry = listed[key]
            try:
                photos = tuple(f"{int(n):06d}" for n in entry["context"])
                targets = tuple(f"{int(n):06d}" for n in entry["target"])
            except (KeyError, TypeError, ValueError):
                raise InputError(f"{table} has no context and target for {key}; get it again") from None
            missing = [id for id in (*photos, *targets) if id not in folder.ids]
            if missing:
                raise InputError(f"scene {key} has no frame {int(missing[0])}; get its chunk again")
            yield Case(key, key, folder, photos, targets)

    return Plan(cases(), len(listed))


def _frames(root: Path, index: Path | None) -> Plan:
    sequences = [root] if any(root.glob("frame-*.pose.txt")) else sorted(root.glob("seq-*"))
    listed = root / "TestSplit.txt"
    if listed.is_file():
        numbers = {line.strip().removeprefix("sequence") for line in listed.read_text().splitlines()}
        wanted = {f"seq-{int(n):02d}" for n in numbers if n.isdigit()}
        sequences = [s for s in sequences if s.name in wanted]
    sequences = [s for s in sequences if s.is_dir()]
    if not sequences:
        raise InputError(f"{root} holds no frames and no seq-01; {PROTOCOLS['7scenes'].get}")

    def cases() -> Iterator[Case]:
        for path in sequences:
            folder = open_frames(path)
            for triple in chosen_triples(folder.ids, PAIRS, APART):
                yield Case(
                    f"{path.name}-{triple.first}-{triple.second}",
                    path.name,
                    folder,
                    (triple.first, triple.second),
                    (triple.between,),
                )

    return Plan(cases())


PROTOCOLS: dict[str, Protocol] = {
    "scannet": Protocol(
        "ScanNet, 40 unseen scenes, as LSM and the paper",
        "Of 30 frames a scene, those at places 1 and 4 of every 8 are targets, their two neighbours the "
        "photos; eight labels by classes of NYU40, everything else is other, 0 is not judged. mIoU is over "
        "labels that occur in truth or answer. Here the pose of the target is the true one, its length "
        "scaled by the first photo's depth, and nothing is fitted to the target.",
        "LSM publishes its 40 scenes (huggingface.co/datasets/Journey9ni/LSM, scannet_test.tar) to those "
        "who accepted the terms of ScanNet; unpack it and give that folder",
        _scannet,
    ),
    "3dovs": Protocol(
        "3D-OVS, annotated photos by their own lists of names",
        "Each annotated photo makes a scene with the next annotated one; both are judged by argmax over the "
        "scene's classes. Others fit a scene to all photos, here two unposed ones must do.",
        "3D-OVS is linked from github.com/Kunhao-Liu/3D-OVS; unpack bed, bench, room, sofa, lawn into one "
        "folder and give it",
        _masked,
    ),
    "re10k": Protocol(
        "RealEstate10K, novel views by pixelSplat's evaluation index",
        "Two context photos and three targets a scene. Poses of targets are the true ones, their length "
        "scaled by the distance of the context cameras; NoPoSplat first fits each target's pose to its "
        "picture, which is not done here and costs decibels.",
        "pixelSplat (github.com/dcharatan/pixelsplat, Acquiring Datasets) names where its chunks are; give "
        "the folder that holds test/index.json",
        _re10k,
    ),
    "7scenes": Protocol(
        "Posed RGB-D frames in the layout of 7-Scenes",
        "Pairs 6, 12, 18 and 24 frames apart, the frame half-way between is the target.",
        "7-Scenes is at microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes; unpack a scene with "
        "its seq-01.zip and give its folder",
        _frames,
    ),
}
NYU_GET = (
    "the labelled NYU Depth v2 is at cs.nyu.edu/~fergus/datasets/nyu_depth_v2.html; give "
    "nyu_depth_v2_labeled.mat, or a folder that train photos made of it"
)
