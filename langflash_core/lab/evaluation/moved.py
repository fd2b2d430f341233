"""`langflash lab eval moved`: two scenes of one room, between which things were moved.

A room is drawn from its seed; three things that stand on its floor are then pushed to other free places,
with what stands on them. Each scene has three photos, of which two are from the same places. A moved thing
is found where the comparison (`langflash_core/inventory/beside.py`) says that what shows it moved; half
found, where it says that it came or went. What it says of things that nobody moved is wrong.

Sizes: V photos of a scene.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.inventory import Inventory, Thing, inventory
from langflash_core.inventory.beside import difference
from langflash_core.inventory.pieces import OPENINGS, STRUCTURE
from langflash_core.lab.evaluation.level import (
    drawn_room,
    kept_scene,
    matched_things,
    seen_through,
    true_instances,
    true_unit,
)
from langflash_core.lab.evaluation.tables import Measure, Table, by_measure, rounded
from langflash_core.lab.rooms import Pack, RoomRenderer, RoomViews, StagedRoom
from langflash_core.lab.rooms.layout import SLACK, Instance, Room
from langflash_core.lab.rooms.sensor import expose
from langflash_core.lab.training.measures import nan_mean
from langflash_core.reconstruction.networks import Networks
from langflash_core.types import Frame

THINGS = 3
FIRST, SECOND = (0, 1, 2), (0, 1, 3)
"""Photos of either scene, of four."""
SEEN = 0.01
"""Of a photo: of a thing that is moved, before and after."""
WAY = (0.6, 2.0)  # m
BY = 0.2
"""Share by which the way may be off, or as many metres."""
_TRIES = 60
_STAYS = (*STRUCTURE, *OPENINGS, "rug", "mat", "curtain")


@dataclass(frozen=True)
class Pushed:
    """A room before and after. ways: metres on the floor that instances went, by their number; along: the
    same for what stood on them."""

    before: StagedRoom
    after: StagedRoom
    ways: dict[int, Float[np.ndarray, "3"]]
    along: dict[int, Float[np.ndarray, "3"]]


def run_moved(
    pack: Pack,
    seeds: Iterable[int],
    render: Callable[..., Frame],
    *,
    keep: Path | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge rooms; a seed whose room has no three things to move is left out.

    Args:
        render: draws depth of a scene from a camera. keep: where scenes are kept and read again.

    Returns:
        Plain JSON: `rooms` (a row each), `refused` (seeds whose scenes cannot be compared) and `summary`.
    """
    chosen, rows, refused, networks = list(seeds), [], [], Networks()
    with RoomRenderer(pack) as drawer:
        for number, seed in enumerate(chosen):
            progress(f"room {seed}", number / max(1, len(chosen)))
            try:
                pushed = pushed_room(drawn_room(pack, drawer, seed, 4), drawer, seed)
            except ValueError:
                continue
            scenes = [
                kept_scene(staged, seed, None if keep is None else keep / name, networks)
                for staged, name in ((pushed.before, "before"), (pushed.after, "after"))
            ]
            found = [
                inventory(scene.with_record(metric_scale=true_unit(scene, staged)))
                for scene, staged in zip(scenes, (pushed.before, pushed.after), strict=True)
            ]
            try:
                rows.append({"seed": seed, **rounded(judge_moved(found[0], found[1], pushed, render))})
            except InputError:  # their photos show too little in common
                refused.append(seed)
    names = [name for name in (rows[0] if rows else {}) if name != "seed"]
    means = {f"{name}_mean": nan_mean(row[name] for row in rows) for name in ("agree",) if rows}
    totals = {name: float(sum(row[name] or 0 for row in rows)) for name in names if name != "agree"}
    counts = {"rooms": float(len(rows)), "refused": float(len(refused))}
    return {"rooms": rows, "refused": refused, "summary": rounded(counts | totals | means)}


def judge_moved(
    before: Inventory, after: Inventory, pushed: Pushed, render: Callable[..., Frame]
) -> dict[str, float]:
    """Counts of what the comparison says of things that were moved, and of others."""
    said = difference(before, after, render)
    before = _with(before, [*(pair.before for pair in said.moved), *said.went])
    after = _with(after, [*(pair.after for pair in said.moved), *said.came])
    listed = _instances(before, pushed.before), _instances(after, pushed.after)
    shown = _mostly(before, pushed.before), _mostly(after, pushed.after)
    of_moved, half, wrong, went_along = {}, set(), 0, {*pushed.ways, *pushed.along}
    for pair in said.moved:
        known = {shown[0][pair.before.id], shown[1][pair.after.id]}
        wrong += not known & went_along
        half |= known
        if len(known) == 1:
            of_moved |= dict.fromkeys(known & set(pushed.ways), pair.by)
    half |= {shown[0][thing.id] for thing in said.went} | {shown[1][thing.id] for thing in said.came}
    ways = {i: float(np.linalg.norm(way)) for i, way in pushed.ways.items()}
    right = [i for i in of_moved if abs(of_moved[i] - ways[i]) <= max(BY, BY * ways[i])]
    others = sum(shown[0][thing.id] not in went_along for thing in said.went)
    others += sum(shown[1][thing.id] not in went_along for thing in said.came)
    return {
        "moved": float(len(ways)),
        "in_both": float(len(set(ways) & set(listed[0].values()) & set(listed[1].values()))),
        "found": float(len(of_moved)),
        "found_by_way": float(len(right)),
        "half": float(len((half & set(ways)) - set(of_moved))),
        "false_moved": float(wrong),
        "false_came_or_went": float(others),
        "stayed": float(len(said.stayed)),
        "unseen": float(len(said.unseen)),
        "agree": said.fit.matches / max(1, said.fit.tried),
    }


def _with(found: Inventory, things: Sequence[Thing]) -> Inventory:
    """Also what the comparison names though the inventory does not list it."""
    known = {thing.id for thing in found.things}
    return replace(found, things=(*found.things, *(thing for thing in things if thing.id not in known)))


def _instances(found: Inventory, staged: StagedRoom) -> dict[str, int]:
    """True instances of things, by the things' ids."""
    return {thing.id: instance for thing, instance in matched_things(found, staged)}


def _mostly(found: Inventory, staged: StagedRoom) -> dict[str, int]:
    """What most of each thing shows, be it a part of that, or a wall."""
    shares, ids = found.shares.sum(0), true_instances(found.scene, staged)
    return {
        thing.id: int(np.bincount(ids[thing.rows], shares[thing.rows]).argmax()) for thing in found.things
    }


# Rooms


def pushed_room(staged: StagedRoom, drawer: RoomRenderer, seed: int) -> Pushed:
    """A room of four photos before and after `THINGS` of its things were moved.

    Raises:
        ValueError: it has no such things, or nowhere to put them where photos see them.
    """
    rng = np.random.default_rng([seed, 17])
    before = _photographed(staged, staged.room, drawer, FIRST)
    for _ in range(_TRIES):
        ways = _pushes(staged, before.views, rng)
        if ways is None:
            continue
        along = {i: way for number, way in ways.items() for i in _carried(staged.room, number)}
        after = _photographed(staged, _pushed(staged.room, ways | along), drawer, SECOND)
        if all(_share(after.views, i) >= SEEN for i in ways):
            return Pushed(before, after, ways, along)
    raise ValueError(f"seed: room {seed} has no {THINGS} things that could be moved where photos see them")


def _photographed(staged: StagedRoom, room: Room, drawer: RoomRenderer, views: Sequence[int]) -> StagedRoom:
    """The room's photos from some of the places; instances are numbered as in the room."""
    drawer.set_room(room)
    chosen, size = list(views), staged.views.images.shape[1:3]
    rng = np.random.default_rng(staged.views.seed)
    pictures = [
        drawer.draw(
            staged.views.viewmats[v].astype(float) @ staged.home, staged.views.Ks[v].astype(float), size
        )
        for v in chosen
    ]
    shown = RoomViews(
        images=np.stack([expose(each.radiance, staged.sensor, rng, staged.grey) for each in pictures]),
        depths=np.stack([each.depth for each in pictures]).astype(np.float32),
        instances=np.stack([each.ids for each in pictures]).astype(np.uint8),
        names=((), *(each.names for each in room.instances)),
        groups=("", *(each.group for each in room.instances)),
        viewmats=staged.views.viewmats[chosen],
        Ks=staged.views.Ks[chosen],
        overlap=staged.views.overlap,
        seed=staged.views.seed,
    )
    return replace(staged, room=room, views=replace(shown, instances=seen_through(shown)))


def _share(views: RoomViews, instance: int) -> float:
    """Of the photo that shows it largest."""
    return float((views.instances == instance).mean((1, 2)).max())


def _pushes(staged: StagedRoom, views: RoomViews, rng: np.random.Generator) -> dict[int, np.ndarray] | None:
    """Ways on the floor of three things, so that none stands in another; None where chance found none."""
    room = staged.room
    loose = [
        number
        for number, one in enumerate(room.instances, 1)
        if one.item >= 0 and one.group not in _STAYS and one.low[1] < 0.05 and _share(views, number) >= SEEN
    ]
    ways: dict[int, np.ndarray] = {}
    for number in rng.permutation(loose).tolist():
        for _ in range(_TRIES):
            turn, length = rng.uniform(0, 2 * math.pi), rng.uniform(*WAY)
            way = length * np.array([math.cos(turn), 0.0, math.sin(turn)])
            if _free(_pushed(room, ways), number, way) and _in_sight(staged, room, number, way):
                ways[number] = way
                break
        if len(ways) == THINGS:
            return ways
    return None


def _free(room: Room, number: int, way: Float[np.ndarray, "3"]) -> bool:
    """Whether a thing could stand there."""
    moved, carried = _shifted(room.instances[number - 1], way), _carried(room, number)
    return room.shell.holds(moved.low, moved.high) and not any(
        _meets(moved, one)
        for other, one in enumerate(room.instances, 1)
        if other != number and other not in carried and one.item >= 0 and one.group not in ("rug", "mat")
    )


def _in_sight(staged: StagedRoom, room: Room, number: int, way: Float[np.ndarray, "3"]) -> bool:
    """Whether a photo of the second scene has its middle in the picture."""
    one, (height, width) = room.instances[number - 1], staged.views.images.shape[1:3]
    middle = np.append((one.low + one.high) / 2 + way, 1.0)
    for view in SECOND:
        x, y, z = staged.views.Ks[view] @ (staged.views.viewmats[view] @ staged.home @ middle)[:3]
        if z > 0.3 and 0 < x / z < width and 0 < y / z < height:
            return True
    return False


def _carried(room: Room, number: int) -> set[int]:
    """Things that stand on one, or in it above its foot."""
    one = room.instances[number - 1]
    return {
        other
        for other, thing in enumerate(room.instances, 1)
        if thing.item >= 0 and other != number and 0.05 < thing.low[1] <= one.high[1] + 0.05
        and (one.low < (thing.low + thing.high) / 2)[[0, 2]].all()
        and ((thing.low + thing.high) / 2 < one.high)[[0, 2]].all()
    }  # fmt: skip


def _pushed(room: Room, ways: dict[int, np.ndarray]) -> Room:
    things = [_shifted(one, ways.get(i, np.zeros(3))) for i, one in enumerate(room.instances, 1)]
    return replace(room, instances=tuple(things))


def _meets(one: Instance, other: Instance) -> bool:
    return bool((one.low + SLACK < other.high).all() and (other.low + SLACK < one.high).all())


def _shifted(one: Instance, way: Float[np.ndarray, "3"]) -> Instance:
    model = one.model.copy()
    model[:3, 3] += way
    return replace(one, model=model, low=one.low + way, high=one.high + way)


MEASURES = (
    ("Rooms", "rooms"),
    ("... refused, since their photos share too little", "refused"),
    ("Things moved", "moved"),
    ("... that both inventories hold", "in_both"),
    ("... said to have moved", "found"),
    (f"... and how far within {BY:.0%} or {BY:g} m", "found_by_way"),
    ("... said to have come or gone alone", "half"),
    ("Others said to have moved", "false_moved"),
    ("Others said to have come or gone", "false_came_or_went"),
    ("Said to have stayed", "stayed"),
    ("Matches that agree, mean share", "agree_mean"),
)


def tables(result: dict) -> list[Table]:
    """The summary."""
    measures = [Measure(title, key, "g") for title, key in MEASURES]
    return [by_measure("", "measure", {"value": result["summary"]}, measures)]
