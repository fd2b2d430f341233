"""`langflash lab eval photos-labelled`: the whole program on single real photos that somebody labelled.

Each photo is reconstructed, its scene drawn from the photo's own camera, and asked as anybody would ask
it. Names are judged on the drawn atoms and, beside them, on the language features of the photo alone; the
depth is the drawn one. Maps of the truth take the nearest value at the size drawn.

Sizes: H W drawn pixels, K atoms, C channels, P phrases, L fine names.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.running import Progress
from langflash_core.images.pictures import centre_box
from langflash_core.images.views import load_views, source_pictures
from langflash_core.lab.evaluation.bench import Bench, files_of
from langflash_core.lab.evaluation.borders import OTHER, UNKNOWN, border_f1, right_near_borders
from langflash_core.lab.evaluation.metrics import Presence, mask_iou, presence_measures
from langflash_core.lab.evaluation.photo_words import PhotoWords, absent_rows, paper_row, photos_of_names
from langflash_core.lab.evaluation.rooms.phrases import MASK_THRESHOLDS, PHRASES
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE
from langflash_core.lab.evaluation.rooms.target import language_maps
from langflash_core.lab.evaluation.segments import label_border_f
from langflash_core.lab.evaluation.sights import (
    Look,
    Sight,
    depth_picture,
    label_picture,
    legend_of,
    photo_picture,
)
from langflash_core.lab.evaluation.tables import Table, cell, labels_table, measures_table, rounded
from langflash_core.lab.evaluation.tallies import Noted, Shelf, judged, merged
from langflash_core.lab.evaluation.words import PAPER_LABELS
from langflash_core.lab.photos import LabelledPhoto, Name, PhotoFolder
from langflash_core.lab.photos.fitting import seen_through
from langflash_core.lab.training.measures import (
    abs_rel,
    accuracy,
    align_scale,
    class_ious,
    confusion,
    depth_measures,
    mean_iou,
    nan_mean,
)
from langflash_core.language.answers import presence_scores
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import LanguageSpace, language_space
from langflash_core.network import PRESETS, LangFlashNet, load_network
from langflash_core.pipeline import query
from langflash_core.types import Frame, Scene, Views

DRAWN = 1
"""Scenes are drawn at so many times the size of the network's photo."""
METHODS = {"atoms": "the program: atoms drawn", "features": "2D features of the photo, no scene"}
"""Where names are read from: the drawn atoms, the features of the photo before there is a scene."""
MEASURES = (
    ("Depth AbsRel, scale aligned", "depth_abs_rel", "one depth", "depth_abs_rel_flat"),
    ("Depth AbsRel, median photo", "depth_abs_rel_median", "", ""),
    ("Depth delta < 1.25, scale aligned", "depth_delta1", "", ""),
    ("Depth AbsRel in metres, no alignment", "depth_abs_rel_metric", "", ""),
    ("True metres per guessed metre, median photo", "depth_scale", "", ""),
    ("Presence precision", "presence_precision", "", ""),
    ("Presence recall", "presence_recall", "", ""),
    ("Presence F1", "presence_f1", "", ""),
    ("Phrases asked, half of them absent", "presence_phrases", "", ""),
    ("Calibration error of scores (ECE)", "calibration_error", "", ""),
    ("Border F of 37 classes", "border_f_atoms", "2D features", "border_f_features"),
    ("At the photo's size: F1 of borders, 4 pixels", "border_f1", "", ""),
    ("At the photo's size: named right within 8 pixels of a border", "right_near_borders", "", ""),
    ("At the photo's size: named right elsewhere", "right_elsewhere", "", ""),
    ("At the photo's size: mIoU of 37 classes", "large_classes_miou", "", ""),
    ("True masks called by their name, of all names of the folder", "masks_right_atoms",
     "2D features", "masks_right_features"),
    ("... mean over names", "mask_names_right_atoms", "2D features", "mask_names_right_features"),
    ("... masks judged", "masks", "", ""),
    ("Share of the picture that the scene covers", "covered", "", ""),
    ("Reconstruction, seconds a photo", "seconds", "", ""),
)  # fmt: skip
COLUMNS = {
    f"{kind}_{what}": f"{text}: {name}"
    for kind, text in {
        "classes": "37 classes",
        "paper": "8 labels",
        "published": "8 labels, desks are other",
        "fine": "fine names",
    }.items()
    for what, name in (("miou", "mIoU"), ("accuracy", "accuracy"))
}
BEST = 10
"""So many fine names are listed from either end."""
LARGE = "atoms, large"
"""The drawn atoms at the photo's size: of these the classes are counted, for one measure."""


@dataclass(frozen=True)
class Judged:
    """What every photo is judged with. network: a second copy, for the features alone; vectors: of
    `words.phrases`, unit rows (P, C)."""

    bench: Bench
    network: LangFlashNet
    space: LanguageSpace
    names: dict[int, Name]
    words: PhotoWords
    vectors: Tensor

    @staticmethod
    def of(folder: PhotoFolder, bench: Bench) -> "Judged":
        """The words of a folder and a checkpoint, ready to judge photos."""
        words = PhotoWords.of(folder.names, photos_of_names(folder, folder.ids))
        space = language_space(PRESETS[bench.preset].space)
        network = load_network(bench.preset, bench.weights)
        return Judged(bench, network, space, folder.names, words, space.encode(words.phrases))


@dataclass
class Tally(Noted):
    """What a run collects. counts: confusion by (method, label set), the last column for pixels without an
    answer; presence: found against truth; scores, truths: of every phrase asked; ious: of the masks of
    present phrases at each of `MASK_THRESHOLDS`, one row each; overlaps: per fine name the pixels of mask and
    truth together, of either, and photos; masks: by (method, name) true masks, and how many are called so."""

    counts: dict[tuple[str, str], Tensor] = field(default_factory=dict)
    presence: Presence = field(default_factory=Presence)
    scores: list[Tensor] = field(default_factory=list)
    truths: list[Tensor] = field(default_factory=list)
    ious: list[Tensor] = field(default_factory=list)
    overlaps: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    masks: dict[tuple[str, str], tuple[int, int]] = field(default_factory=dict)

    def count(self, method: str, labels: str, found: Tensor, truth: Tensor, classes: int) -> None:
        """Add pixels: rows `found` (-1: no answer) against `truth` (-1: not judged), both flat."""
        answered = torch.where(found < 0, classes, found)
        table = confusion(answered, truth, classes + 1)
        self.counts[method, labels] = self.counts.get((method, labels), 0) + table


@dataclass(frozen=True)
class Drawn:
    """One photo as the program shows it: relevancy maps (P, H, W) of `words.judged`, from `threshold` on
    present; the frame and its scene; the truth's ids and depths (H, W) under the same pixels; the photo
    as the network saw it."""

    scene: Scene
    frame: Frame
    maps: Tensor
    threshold: float
    ids: Tensor
    depths: Tensor
    views: Views


def run_photos(
    folder: PhotoFolder,
    ids: Sequence[str],
    bench: Bench,
    *,
    shelf: Shelf | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> tuple[dict, Tally]:
    """Judge a checkpoint on photos of a labelled folder.

    Args:
        ids: of the photos judged; how often a name occurs is counted in the whole folder.
        bench: whose renderer draws weight maps.

    Returns:
        Plain JSON ("measures", "labels", "class_ious", "paper_ious", "names", "masks") and what it was
        made from.

    Raises:
        InputError: the folder has no labels, or a map cannot be used. WeightsError: of the checkpoint.
    """
    progress("names of the folder", 0.0)
    setting = Judged.of(folder, bench)
    kept = judged(
        ((id, id) for id in ids),
        lambda id, _: judge(setting, folder.photo(id)),
        count=len(ids),
        shelf=shelf,
        progress=lambda stage, fraction: progress(f"photo {stage}", 0.1 + 0.9 * fraction),
    )
    tally = merged(list(kept.values()))
    result = {
        "weights": bench.made_with,
        "folder": folder.root.name,
        "photos": len(ids),
        "numbers": [ids[0], ids[-1]],
        **summary(tally, setting.words),
    }
    return result, tally


def draw_photo(judged: Judged, photo: LabelledPhoto) -> tuple[Drawn, float]:
    """A photo through the whole program, and the seconds that the reconstruction took."""
    bench, preset = judged.bench, PRESETS[judged.bench.preset]
    with files_of([photo]) as paths:
        start = time.perf_counter()
        scene = bench.scene(paths, intrinsics=photo.intrinsics)
        seconds = time.perf_counter() - start
        area = preset.native_area if bench.size is None else bench.size**2
        views = load_views(
            paths, intrinsics=photo.intrinsics, area=area, multiple=preset.patch, square=preset.square
        )
    width, height = scene.view_size[0] * DRAWN, scene.view_size[1] * DRAWN
    frame = judged.bench.render(scene, scene.camera(0, width, height))
    assert frame.weight_maps is not None
    compiled = compile_query(scene, judged.space, judged.words.judged)
    maps = relevance_maps(frame.weight_maps, compiled)
    box = centre_box(photo.image.shape[1], photo.image.shape[0], scene.view_size)
    ids = torch.zeros(height, width, dtype=torch.int64)
    depths = torch.zeros(height, width)
    if photo.labels is not None:
        ids = seen_through(photo.labels, box, (width, height))
    if photo.depths is not None:
        depths = seen_through(photo.depths, box, (width, height))
    return Drawn(scene, frame, maps, compiled.threshold, ids, depths, views), seconds


@torch.no_grad()
def judge(judged: Judged, photo: LabelledPhoto, look: Look | None = None) -> Tally:
    """Everything about one photo."""
    tally = Tally()
    drawn, seconds = draw_photo(judged, photo)
    tally.note(seconds=seconds, covered=float((drawn.frame.alphas >= ANSWERING.covered_alpha).float().mean()))
    if photo.depths is not None:
        judge_depth(drawn, photo.metric, tally)
    if photo.labels is not None:
        judge_names(judged, drawn, tally)
        overlap_fine(judged, drawn, tally)
        judge_borders(judged, photo, drawn, tally)
        ask_photo(judged, drawn, int(photo.id) if photo.id.isdigit() else 0, tally)
    if look is not None:
        look(_sight(judged, photo, drawn))
    return tally


def _sight(judged: Judged, photo: LabelledPhoto, drawn: Drawn) -> Sight:
    """The photo for people: what the scene shows from its own place."""
    words, truth = judged.words, judged.words.classes_of[drawn.ids]
    empty = (drawn.maps == 0).all(0)
    found = drawn.maps[words.rows(words.classes)].argmax(0).masked_fill(empty | (truth < 0), -1)
    pictures = {
        "photo": photo_picture(drawn.views.images[0].permute(1, 2, 0)),
        "drawn": photo_picture(drawn.frame.rgb),
        "labels": label_picture(found.numpy()),
        "true labels": label_picture(truth.numpy()),
    }
    numbers = {}
    if bool((truth >= 0).any()):
        numbers["labels right"] = float((found == truth)[truth >= 0].float().mean())
    valid = (drawn.depths > 0) & (drawn.frame.alphas >= ANSWERING.covered_alpha)
    if bool(valid.any()):
        real = torch.where(valid, drawn.depths, 0.0)
        own = align_scale(drawn.frame.depths, real)
        longest = float(real.max())
        pictures["depth"] = depth_picture(own.double().numpy(), longest)
        pictures["true depth"] = depth_picture(drawn.depths.double().numpy(), longest)
        numbers["depth_abs_rel"] = abs_rel(own, real)
    worth = numbers.get("labels right", -numbers.get("depth_abs_rel", math.nan))
    legend = legend_of(words.classes, found.numpy(), truth.numpy())
    return Sight(photo.id, f"photo {photo.id}", pictures, numbers, worth, legend)


def judge_depth(drawn: Drawn, metric: bool, tally: Tally) -> None:
    """The drawn depth with its scale aligned, a wall instead of it, and lengths as they were guessed."""
    truth = torch.where(drawn.frame.alphas >= ANSWERING.covered_alpha, drawn.depths, 0.0)
    tally.note(**depth_measures(drawn.frame.depths, truth))
    if metric:
        metres = drawn.frame.depths * (drawn.scene.record.network_unit or math.nan)
        valid = (truth > 0) & (metres > 0)
        tally.note(
            depth_abs_rel_metric=abs_rel(metres, truth),
            depth_scale=float((truth[valid] / metres[valid]).median()) if bool(valid.any()) else math.nan,
        )


def judge_names(judged: Judged, drawn: Drawn, tally: Tally) -> None:
    """37 classes, the paper's labels and fine names, by argmax over each list, of both methods."""
    words = judged.words
    empty = (drawn.maps == 0).all(0)
    features = language_maps(judged.network, drawn.views)[0][0, 0].float()  # (C, h, w)
    alone = torch.einsum("pc,chw->phw", judged.vectors[: len(drawn.maps)], features)
    size = (drawn.ids.shape[0], drawn.ids.shape[1])  # interpolating features first would give the same
    alone = F.interpolate(alone[None], size=size, mode="bilinear", align_corners=False)[0]
    for method, maps in zip(METHODS, (drawn.maps, alone), strict=True):
        unanswered = empty if method == "atoms" else torch.zeros_like(empty)
        best = maps[words.rows(words.classes)].argmax(0).masked_fill(unanswered, -1).flatten()
        truth = words.classes_of[drawn.ids].flatten()
        tally.count(method, "classes", best, truth, len(words.classes))
        borders = label_border_f(best.view(size).numpy(), truth.view(size).numpy())
        tally.note(**{f"border_f_{method}": borders})
        for name, published in (("paper", False), ("published", True)):
            table = words.published if published else words.papers
            rows = torch.tensor([*(paper_row(c, published=published) for c in words.classes), -1])
            tally.count(method, name, rows[best], table[drawn.ids].flatten(), len(PAPER_LABELS))
        if words.fine:
            fine = maps[words.rows(words.fine)].argmax(0).masked_fill(unanswered, -1).flatten()
            tally.count(method, "fine", fine, words.fine_of[drawn.ids].flatten(), len(words.fine))
    name_masks(judged, drawn, features, tally)


def name_masks(judged: Judged, drawn: Drawn, features: Tensor, tally: Tally) -> None:
    """What the true mask of every name in sight is called, of all names of the folder, by the mean of what
    lies in it; features (C, h, w) of the photo. A name without `MIN_SHARE` of the picture is not judged."""
    words = judged.words
    rows = words.every_of[drawn.ids].flatten()
    areas = torch.bincount(rows[rows >= 0], minlength=len(words.every))
    shown = torch.nonzero(areas >= MIN_SHARE * len(rows)).flatten()
    if not len(shown):
        return
    inside = (rows == shown[:, None]).float() / areas[shown, None]  # (M, H W), rows of sum 1
    assert drawn.frame.weight_maps is not None
    compiled = compile_query(drawn.scene, judged.space, words.every)
    atoms = relevance_maps(inside @ drawn.frame.weight_maps.flatten(0, 1), compiled)
    size = (drawn.ids.shape[0], drawn.ids.shape[1])
    wide = F.interpolate(features[None], size=size, mode="bilinear", align_corners=False)[0]
    alone = judged.vectors[words.rows(words.every)] @ (inside @ wide.flatten(1).T).T
    for method, answers in zip(METHODS, (atoms, alone), strict=True):  # (P, M)
        right = (answers.argmax(0) == shown) & (answers != 0).any(0)
        for row, hit in zip(shown.tolist(), right.tolist(), strict=True):
            masks, hits = tally.masks.get((method, words.every[row]), (0, 0))
            tally.masks[method, words.every[row]] = (masks + 1, hits + hit)


def judge_borders(judged: Judged, photo: LabelledPhoto, drawn: Drawn, tally: Tally) -> None:
    """The 37 classes and their borders, drawn again at the size of the photo (768 pixels long at most)."""
    assert photo.labels is not None
    height, width = source_pictures(drawn.views)[0].shape[1:]
    frame = judged.bench.render(drawn.scene, drawn.scene.camera(0, width, height))
    assert frame.weight_maps is not None
    words = judged.words
    maps = relevance_maps(frame.weight_maps, compile_query(drawn.scene, judged.space, words.classes))
    found = maps.argmax(0).masked_fill((maps == 0).all(0), -1)
    box = centre_box(photo.image.shape[1], photo.image.shape[0], drawn.scene.view_size)
    ids = seen_through(photo.labels, box, (width, height))
    truth = words.classes_of[ids].masked_fill(ids == 0, UNKNOWN)
    tally.count(LARGE, "classes", found.flatten(), truth.flatten(), len(words.classes))
    truth = truth.masked_fill((truth < 0) & (ids > 0), OTHER)
    inside, outside = right_near_borders(found.numpy(), truth.numpy())
    f1 = border_f1(found.numpy(), truth.numpy())
    tally.note(border_f1=f1, right_near_borders=inside, right_elsewhere=outside)


def ask_photo(judged: Judged, drawn: Drawn, seed: int, tally: Tally) -> None:
    """As many things that are there as things that are not, asked as anybody asks, and the masks of the
    former, where pixels without a label count for nothing."""
    words, generator = judged.words, torch.Generator().manual_seed(seed)
    labelled = drawn.ids > 0
    shown = torch.bincount(drawn.ids.flatten(), minlength=len(words.asked_of))
    there = sorted({name.text for id, name in judged.names.items() if int(shown[id]) > 0})
    rows = words.asked_of[drawn.ids]
    shares = torch.bincount(rows[rows >= 0], minlength=len(words.asked)) / rows.numel()
    visible = torch.nonzero(shares >= MIN_SHARE).flatten()
    present = visible[torch.randperm(len(visible), generator=generator)][: PHRASES // 2].tolist()
    asked = words.rows(words.asked)
    absent = absent_rows(there, words.asked, judged.vectors[asked], len(present), generator)
    present = present[: len(absent)]
    if not present:
        return
    phrases = [words.asked[row] for row in (*present, *absent)]
    height, width = rows.shape
    found = query(drawn.scene, phrases, size=(width, height), render=lambda scene, camera: drawn.frame)
    truths = torch.arange(len(phrases)) < len(present)
    tally.presence += Presence.of([answer.found for answer in found.answers], truths.tolist())
    tally.scores.append(torch.tensor([answer.score for answer in found.answers]))
    tally.truths.append(truths)
    for place, row in enumerate(present):
        values, truth = found.relevance[place][labelled], rows[labelled] == row
        tally.ious.append(torch.tensor([mask_iou(values >= limit, truth) for limit in MASK_THRESHOLDS]))


def overlap_fine(judged: Judged, drawn: Drawn, tally: Tally) -> None:
    """Masks of the fine names that a photo shows against the truth, pixels added up over photos; those
    without a label count for nothing."""
    labelled = drawn.ids > 0
    rows = judged.words.fine_of[drawn.ids][labelled]
    places = judged.words.rows(judged.words.fine)
    for row in sorted(set(rows[rows >= 0].tolist())):
        values, truth = drawn.maps[places[row]], rows == row
        score = float(presence_scores(values[None], torch.ones_like(labelled)))
        lit_from = ANSWERING.lit_from(score, drawn.threshold)
        found = (values >= lit_from)[labelled] & (score >= drawn.threshold)
        name = judged.words.fine[row]
        both, either, photos = tally.overlaps.get(name, (0, 0, 0))
        tally.overlaps[name] = (
            both + int((found & truth).sum()),
            either + int((found | truth).sum()),
            photos + 1,
        )


def summary(tally: Tally, words: PhotoWords) -> dict:
    """Means, medians and tables of a run, rounded; plain JSON."""
    measures = tally.means()
    if "depth_abs_rel" in tally.numbers:
        measures["depth_abs_rel_median"] = tally.median("depth_abs_rel")
    if "depth_scale" in tally.numbers:
        measures["depth_scale"] = tally.median("depth_scale")
    if tally.scores:
        measures |= presence_measures(tally.presence, torch.cat(tally.scores), torch.cat(tally.truths))
        measures["presence_phrases"] = float(sum(len(s) for s in tally.scores))
    if (LARGE, "classes") in tally.counts:
        counts = tally.counts[LARGE, "classes"]
        measures["large_classes_miou"] = mean_iou(counts, range(len(words.classes)))
    masks = _mask_report(tally, words)
    if masks:
        measures["masks"] = float(sum(row["masks"] for row in masks))
        for method in METHODS:
            hits = sum(row[method] for row in masks)
            measures[f"masks_right_{method}"] = hits / measures["masks"]
            measures[f"mask_names_right_{method}"] = nan_mean(row[method] / row["masks"] for row in masks)
    labels: dict[str, dict[str, float]] = {}
    for (method, kind), counts in tally.counts.items():
        if method not in METHODS:
            continue
        row = labels.setdefault(method, {})
        row[f"{kind}_accuracy"] = accuracy(counts)
        row[f"{kind}_miou"] = mean_iou(counts, range(len(counts) - 1))
    return {
        "measures": rounded(dict(sorted(measures.items()))),
        "labels": {method: rounded(row) for method, row in labels.items()},
        "class_ious": _ious(tally, "classes", words.classes),
        "paper_ious": _ious(tally, "paper", PAPER_LABELS),
        "names": _fine_report(tally, words),
        "masks": masks,
    }


def _mask_report(tally: Tally, words: PhotoWords) -> list[dict]:
    """Names in sight with their true masks, and how many of these each method calls so."""
    return [
        {
            "name": name,
            "masks": tally.masks["atoms", name][0],
            **{method: tally.masks[method, name][1] for method in METHODS},
        }
        for name in words.every
        if ("atoms", name) in tally.masks
    ]


def _ious(tally: Tally, kind: str, names: Sequence[str]) -> dict[str, dict[str, float | None]]:
    """Per method: IoU of every label of a list that occurs."""
    return {
        method: rounded(dict(zip(names, class_ious(tally.counts[method, kind])[:-1].tolist(), strict=True)))
        for method in METHODS
        if (method, kind) in tally.counts
    }


def _fine_report(tally: Tally, words: PhotoWords) -> list[dict]:
    """Fine names in sight, best first: photos judged, IoU by argmax over all fine names, and that of the
    mask of whoever asks for the name."""
    if ("atoms", "fine") not in tally.counts:
        return []
    ious = class_ious(tally.counts["atoms", "fine"])[:-1].tolist()
    rows = []
    for name, iou in zip(words.fine, ious, strict=True):
        both, either, photos = tally.overlaps.get(name, (0, 0, 0))
        if photos:
            asked = both / either if either else math.nan
            rows.append({"name": name, "photos": photos, **rounded({"iou": iou, "asked_iou": asked})})
    return sorted(rows, key=lambda row: -(row["iou"] or 0))


def tables(result: dict) -> list[Table]:
    """Measures, labels, IoU of every label that occurs, and fine names."""
    own = [measures_table("", MEASURES, result["measures"])]
    if not result["labels"]:
        return own
    return [
        *own,
        labels_table("", METHODS, COLUMNS, result["labels"]),
        *(_ious_table(result[ious]) for ious in ("paper_ious", "class_ious")),
        _fine_table(result["names"]),
    ]


def _ious_table(ious: dict[str, dict[str, float | None]]) -> Table:
    kept = [name for name, value in ious["atoms"].items() if value is not None]
    rows = [(title, *(cell(ious[method][name]) for name in kept)) for method, title in METHODS.items()]
    return Table("", ("IoU", *kept), rows)


def _fine_table(names: Sequence[dict]) -> Table:
    """The best and the worst fine names, with the means over all of them."""
    header = ("fine name", "photos", "IoU among fine names", "IoU of the mask when asked")
    if not names:
        return Table("", header, [])
    means = [sum(row[key] or 0 for row in names) / len(names) for key in ("iou", "asked_iou")]
    listed = names if len(names) <= 2 * BEST else [*names[:BEST], *names[-BEST:]]
    rows = [(r["name"], str(r["photos"]), cell(r["iou"]), cell(r["asked_iou"])) for r in listed]
    return Table("", header, [(f"mean of {len(names)}", "", *map(cell, means)), *rows])
