"""A furnished room by rules. World: metres, y up, the floor at y = 0.

Boxes never intersect (touching by less than `SLACK` is allowed). Everything follows from the seed.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from langflash_core.errors import InputError
from langflash_core.lab.rooms.catalogue import PARAMETRIC, TRAIN_LIBRARIES, UNSEEN, Item
from langflash_core.lab.rooms.pack import Pack
from langflash_core.lab.rooms.plan import ODDS, ON_TOP, ROOM_PLANS, ROOM_SHARES, Step, hang_height, role
from langflash_core.lab.rooms.shell import Opening, Shell, Style, Wall, make_shell, random_style

SLACK = 0.01
_MOST_ODDS = 4
_MAX_INSTANCES = 200
# Things made in any colour: their models are often plain white.
_DYED = frozenset(
    {"sofa", "armchair", "chair", "stool", "bed", "towel", "pouf", "vase", "lamp", "clothes", "trash bin"}
)
_PAINTED = frozenset({"wardrobe", "dresser", "cabinet", "bookcase", "door", "table", "desk", "bedside table"})


@dataclass(frozen=True)
class Instance:
    """One thing in the room.

    Attributes:
        item: index in the pack; -1 for wall, floor and ceiling.
        names: lower-case words, the catalogue name first.
        group: class group.
        model: item frame -> world.
        low, high: world bounding box, m.
        tint: factor on colours.
        seed: in [0, 1), for patterns.
        glow: emitted light, 0 for none.
    """

    item: int
    names: tuple[str, ...]
    group: str
    model: Float[np.ndarray, "4 4"]
    low: Float[np.ndarray, " 3"]
    high: Float[np.ndarray, " 3"]
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    seed: float = 0.0
    glow: float = 0.0


@dataclass(frozen=True)
class Room:
    """A room to draw. Instance ids are positions in `instances` plus 1; wall, floor, ceiling come first."""

    kind: str
    shell: Shell
    style: Style
    instances: tuple[Instance, ...]
    seed: int


@dataclass
class _Site:
    """A room in the making."""

    rng: np.random.Generator
    pack: Pack
    roles: dict[str, list[int]]
    shell: Shell
    placed: list[Instance] = field(default_factory=list)
    keep_out: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)


def make_room(seed: int, pack: Pack, libraries: tuple[str, ...] = TRAIN_LIBRARIES) -> Room:
    """Lay out a room.

    Args:
        seed: everything follows from it.
        pack: furniture.
        libraries: which of the pack's libraries may appear; models made here always may.

    Returns:
        A room with at least walls, floor and ceiling.

    Raises:
        InputError: the pack holds nothing of these libraries.
    """
    rng = np.random.default_rng(seed)
    allowed = pack.select(libraries)
    if not any(pack.items[i].library in libraries for i in allowed):
        held = ", ".join(sorted({item.library for item in pack.items}))
        raise InputError(
            f"the furniture is of {held}, but these rooms are furnished from {', '.join(libraries)}; "
            "choose another set of rooms (--set), or pack those libraries"
        )
    roles: dict[str, list[int]] = {}
    for i in allowed:
        roles.setdefault(role(pack.items[i]), []).append(i)
    kinds, shares = zip(*ROOM_SHARES, strict=True)
    kind = str(rng.choice(kinds, p=shares))
    site = _Site(rng, pack, roles, make_shell(rng, kind))
    site = replace(site, shell=_cut_openings(site, kind))
    for step in ROOM_PLANS[kind]:
        _do_step(site, step)
    _fill_surfaces(site)
    _scatter_odds(site)
    style = _sun_through_window(rng, random_style(rng, kind), site.shell)
    structure = [_structural(name, site.shell) for name in ("wall", "floor", "ceiling")]
    return Room(kind, site.shell, style, tuple(structure + site.placed)[:_MAX_INSTANCES], seed)


def _structural(name: str, shell: Shell) -> Instance:
    low, high = np.zeros(3), np.array([shell.size[0], shell.height, shell.size[1]])
    return Instance(-1, (name,), name, np.eye(4), low, high)


def _sun_through_window(rng: np.random.Generator, style: Style, shell: Shell) -> Style:
    """Turn the sun so that it shines in at some window."""
    windows = [o for o in shell.openings if o.window]
    if not windows:
        return style
    inward = shell.walls[windows[int(rng.integers(len(windows)))].wall].inward
    azimuth = math.atan2(-inward[1], -inward[0]) + float(rng.uniform(-0.9, 0.9))
    up = style.sun_direction[1]
    level = math.sqrt(max(1 - up * up, 0.0))
    return replace(style, sun_direction=(level * math.cos(azimuth), up, level * math.sin(azimuth)))


def _cut_openings(site: _Site, kind: str) -> Shell:
    """Doors and windows into the walls; their fronts keep clear."""
    shell, rng = site.shell, site.rng
    wanted = ["door"] * int(rng.integers(1, 3)) + ["window"] * int(
        rng.integers(0 if kind in {"hall", "bathroom"} else 1, 4)
    )
    openings: list[Opening] = []
    for group in wanted:
        candidates = [i for i in site.roles.get(group, []) if site.pack.items[i].size[0] < 2.6]
        if not candidates:
            continue
        index = int(rng.choice(candidates))
        for _ in range(8):
            opening = _try_opening(site, index, openings)
            if opening is not None:
                openings.append(opening)
                break
    return replace(shell, openings=tuple(openings))


def _try_opening(site: _Site, index: int, openings: list[Opening]) -> Opening | None:
    item, rng, shell = site.pack.items[index], site.rng, site.shell
    wall = int(rng.integers(len(shell.walls)))
    width, height, depth = item.size
    if width > shell.walls[wall].length - 0.3:
        return None
    centre = float(rng.uniform(width / 2 + 0.12, shell.walls[wall].length - width / 2 - 0.12))
    foot = 0.0 if item.group == "door" else item.elevation
    if item.group == "window" and foot < 0.05 and height < 1.8:
        foot = 0.9
    squeeze = min(1.0, (shell.height - foot - 0.08) / height)
    if squeeze < 0.75:
        foot, squeeze = 0.3, min(1.0, (shell.height - 0.38) / height)
    for other in openings:
        if other.wall == wall and abs(other.centre - centre) < (other.width + width) / 2 + 0.1:
            return None
    inside = depth * (1 - item.wall_front)
    placed = _place(
        site,
        index,
        _on_wall(shell.walls[wall], centre, inside - depth / 2, foot),
        shell.walls[wall].yaw,
        (1.0, squeeze, 1.0),
    )
    site.placed.append(placed)
    front = 0.8 if item.group == "door" else 0.25
    low, high = _wall_box(shell.walls[wall], centre, width, front, foot, foot + height * squeeze)
    site.keep_out.append((low, high))
    if item.group == "window" and rng.random() < 0.45:
        _dress_window(site, shell.walls[wall], centre, width, foot + height * squeeze)
    return Opening(wall, centre, width, foot, height * squeeze, item.group == "window")


def _dress_window(site: _Site, wall: Wall, centre: float, width: float, top: float) -> None:
    """A curtain on each side, from above the window to near the floor."""
    drapes = [i for i in site.roles.get("curtain", []) if site.pack.items[i].library == "builtin"]
    if not drapes:
        return
    item = site.pack.items[drapes[0]]
    spread, head = float(site.rng.uniform(0.3, 0.5)), min(top + 0.12, site.shell.height - 0.02)
    tint, seed, window = None, float(site.rng.random()), len(site.placed) - 1
    for side in (-1.0, 1.0):
        along = centre + side * (width / 2 + spread / 2 - 0.12)
        scale = (spread / item.size[0], (head - 0.03) / item.size[1], 1.0)
        placed = _place(site, drapes[0], _on_wall(wall, along, 0.13, 0.03), wall.yaw, scale)
        tint = tint or placed.tint
        if site.shell.holds(placed.low, placed.high):
            _commit(site, replace(placed, tint=tint, seed=seed), window, openings=False)


def _on_wall(wall: Wall, along: float, out: float, foot: float) -> np.ndarray:
    point = wall.start + wall.direction * along + wall.inward * out
    return np.array([point[0], foot, point[1]])


def _wall_box(
    wall: Wall, centre: float, width: float, depth: float, foot: float, top: float
) -> tuple[np.ndarray, np.ndarray]:
    a = _on_wall(wall, centre - width / 2, 0.0, foot)
    b = _on_wall(wall, centre + width / 2, depth, top)
    return np.minimum(a, b), np.maximum(a, b)


def _place(
    site: _Site,
    index: int,
    position: np.ndarray,
    yaw: float,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Instance:
    """An instance with its foot's centre at `position`, its front turned to `yaw`."""
    item, rng = site.pack.items[index], site.rng
    cos, sin = math.cos(yaw), math.sin(yaw)
    model = np.eye(4)
    model[:3, :3] = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]) * np.array(scale)
    model[:3, 3] = position
    width, height, depth = np.array(item.size) * scale
    half = np.array([abs(cos) * width + abs(sin) * depth, 0.0, abs(sin) * width + abs(cos) * depth]) / 2
    low, high = position - half, position + half + [0.0, height, 0.0]
    tint = _tint(rng, item)
    glow = float(rng.uniform(0.6, 2.5)) if item.light and rng.random() < 0.6 else 0.0
    return Instance(index, item.names, item.group, model, low, high, tint, float(rng.random()), glow)


def _tint(rng: np.random.Generator, item: Item) -> tuple[float, float, float]:
    if item.library == "builtin" and item.group in {"rug", "curtain", "cushion", "blanket", "book"}:
        hue = rng.random()
        vivid = rng.uniform(0.05, 0.55)
        base = 1 - vivid * (0.5 + 0.5 * np.cos(2 * np.pi * (hue + np.array([0.0, 1 / 3, 2 / 3]))))
        tint = base * rng.uniform(0.45, 1.2)
    elif rng.random() < (0.45 if item.group in _DYED else 0.3 if item.group in _PAINTED else 0.0):
        hue, vivid = rng.random(), rng.uniform(0.1, 0.6 if item.group in _DYED else 0.35)
        wheel = 0.5 + 0.5 * np.cos(2 * np.pi * (hue + np.array([0.0, 1 / 3, 2 / 3])))
        tint = rng.uniform(0.55, 1.15) * (1 - vivid * (1 - wheel))
    else:
        tint = rng.uniform(0.82, 1.12) * rng.uniform(0.94, 1.06, 3)
    red, green, blue = (float(v) for v in np.clip(tint, 0.05, 1.3))
    return red, green, blue


def _fits(site: _Site, low: np.ndarray, high: np.ndarray, ignore: int = -1, openings: bool = True) -> bool:
    """Inside the room, and clear of everything placed except `ignore`."""
    if not site.shell.holds(low, high):
        return False
    others = [
        (p.low, p.high) for k, p in enumerate(site.placed) if k != ignore and p.group not in {"rug", "mat"}
    ]
    others += site.keep_out if openings else []
    for other_low, other_high in others:
        if np.all(low + SLACK < other_high) and np.all(other_low + SLACK < high):
            return False
    return True


def _do_step(site: _Site, step: Step) -> None:
    actions = {
        "wall": _at_wall,
        "middle": _in_middle,
        "hang": _hang,
        "ceiling": _from_ceiling,
        "floor": _on_floor,
    }
    count = int(site.rng.integers(step.low, step.high + 1))
    if step.where == "counter":
        _counter(site, step.groups, count)
        return
    for _ in range(count):
        index = _draw(site, step.groups)
        if index is not None:
            placed = actions[step.where](site, index)
            if placed is not None:
                _follow(site, placed, step.follow)


def _draw(site: _Site, groups: tuple[str, ...]) -> int | None:
    available = [g for g in groups if site.roles.get(g)]
    if not available:
        return None
    group = available[int(site.rng.integers(len(available)))]
    return int(site.rng.choice(site.roles[group]))


def _scale(site: _Site) -> tuple[float, float, float]:
    s = float(site.rng.uniform(0.93, 1.07))
    return (s, s, s)


def _commit(site: _Site, instance: Instance, ignore: int = -1, openings: bool = True) -> int | None:
    if not _fits(site, instance.low, instance.high, ignore, openings):
        return None
    site.placed.append(instance)
    return len(site.placed) - 1


def _at_wall(site: _Site, index: int, tries: int = 14) -> int | None:
    """Back to a wall, facing in."""
    item = site.pack.items[index]
    if item.elevation > 0.15 and item.size[1] < 1.6:
        return _hang(site, index)
    scale = _scale(site)
    for _ in range(tries):
        wall = site.shell.walls[int(site.rng.integers(len(site.shell.walls)))]
        half = item.size[0] * scale[0] / 2
        if 2 * half > wall.length - 0.05:
            continue
        lowest, highest = half + 0.02, wall.length - half - 0.02
        along = (
            lowest
            if site.rng.random() < 0.15
            else float(site.rng.uniform(lowest, max(highest, lowest + 1e-6)))
        )
        out = item.size[2] * scale[2] / 2 + float(site.rng.uniform(0.015, 0.06))
        placed = _place(site, index, _on_wall(wall, along, out, 0.0), wall.yaw, scale)
        done = _commit(site, placed)
        if done is not None:
            return done
    return None


def _in_middle(site: _Site, index: int, tries: int = 12) -> int | None:
    item = site.pack.items[index]
    if item.group == "rug":
        return _on_floor(site, index)
    scale = _scale(site)
    for _ in range(tries):
        yaw = math.pi / 2 * int(site.rng.integers(4))
        spread = np.array(site.shell.size)
        x, z = spread * site.rng.uniform(0.25, 0.75, 2)
        done = _commit(site, _place(site, index, np.array([x, 0.0, z]), yaw, scale))
        if done is not None:
            return done
    return None


def _on_floor(site: _Site, index: int, tries: int = 10) -> int | None:
    """Anywhere on the floor, turned freely; flat things lie under the others."""
    item, scale = site.pack.items[index], _scale(site)
    flat = item.group in {"rug", "mat"}
    for _ in range(tries):
        yaw = math.pi / 2 * int(site.rng.integers(4)) if flat else float(site.rng.uniform(0, 2 * math.pi))
        x, z = np.array(site.shell.size) * site.rng.uniform(0.08, 0.92, 2)
        placed = _place(site, index, np.array([x, 0.003 if flat else 0.0, z]), yaw, scale)
        if flat:
            if site.shell.holds(placed.low, placed.high) and not any(
                p.group in {"rug", "mat"} for p in site.placed
            ):
                site.placed.append(placed)
                return len(site.placed) - 1
            continue
        done = _commit(site, placed)
        if done is not None:
            return done
    return None


def _hang(site: _Site, index: int, tries: int = 12) -> int | None:
    item = site.pack.items[index]
    foot = hang_height(item, float(site.rng.random()))
    foot = min(foot, site.shell.height - item.size[1] - 0.05)
    if foot < 0:
        return None
    for _ in range(tries):
        wall = site.shell.walls[int(site.rng.integers(len(site.shell.walls)))]
        if item.size[0] > wall.length - 0.2:
            continue
        along = float(site.rng.uniform(item.size[0] / 2 + 0.05, wall.length - item.size[0] / 2 - 0.05))
        placed = _place(site, index, _on_wall(wall, along, item.size[2] / 2 + 0.002, foot), wall.yaw)
        done = _commit(site, placed)
        if done is not None:
            return done
    return None


def _from_ceiling(site: _Site, index: int, tries: int = 6) -> int | None:
    item = site.pack.items[index]
    if item.size[1] > 0.95:
        return None
    for _ in range(tries):
        x, z = np.array(site.shell.size) * site.rng.uniform(0.35, 0.65, 2)
        foot = site.shell.height - item.size[1] - 0.001
        done = _commit(site, _place(site, index, np.array([x, foot, z]), 0.0))
        if done is not None:
            return done
    return None


def _counter(site: _Site, groups: tuple[str, ...], count: int) -> None:
    """Kitchen units in a row along the longest free wall, cupboards and a hood above."""
    walls = sorted(site.shell.walls, key=lambda w: -w.length * float(site.rng.uniform(0.6, 1.0)))
    for wall in walls[:2]:
        along = float(site.rng.uniform(0.02, 0.4))
        for _ in range(count):
            index = _draw(site, groups)
            if index is None:
                return
            item = site.pack.items[index]
            middle, out = along + item.size[0] / 2, item.size[2] / 2 + 0.01
            if along + item.size[0] > wall.length:
                break
            done = None
            if item.elevation < 0.3:
                done = _commit(site, _place(site, index, _on_wall(wall, middle, out, 0.0), wall.yaw))
            if done is not None:
                _above(site, wall, middle, item)
                count -= 1
            along += item.size[0] + 0.004 if done is not None else 0.3
        if count <= 2:
            return


def _above(site: _Site, wall: Wall, along: float, below: Item) -> None:
    if below.size[1] > 1.3 or site.rng.random() < 0.3:
        return
    index = _draw(site, ("range hood",) if below.group == "stove" else ("wall cabinet",))
    if index is None:
        return
    item = site.pack.items[index]
    foot = min(hang_height(item, 0.5), site.shell.height - item.size[1] - 0.02)
    if foot > below.size[1] + 0.25:
        _commit(
            site,
            _place(site, index, _on_wall(wall, along, item.size[2] / 2 + 0.002, foot), wall.yaw),
        )


def _follow(site: _Site, anchor: int, groups: tuple[str, ...]) -> None:
    """Chairs to tables, bedside tables to beds, coffee tables to sofas."""
    if not groups:
        return
    group = str(site.rng.choice(list(groups)))
    main = site.placed[anchor]
    if group == "bedside table":
        sides = [(-1.0, 0.0), (1.0, 0.0)]
    elif group == "coffee table" or main.group == "desk":
        sides = [(0.0, 1.0)]
    else:
        sides = [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
    index = _draw(site, (group,))
    if index is None or group == main.group:
        return
    for side in sides[: int(site.rng.integers(1, len(sides) + 1))]:
        _beside(site, main, index, group, side)


def _beside(site: _Site, main: Instance, index: int, group: str, side: tuple[float, float]) -> None:
    item, rng = site.pack.items[index], site.rng
    if item.elevation > 0.2:
        return
    turn = main.model[:3, :3] / np.linalg.norm(main.model[:3, :3], axis=0)
    size = np.abs(turn.T @ (main.high - main.low))
    yaw_main = math.atan2(turn[0, 2], turn[2, 2])
    gap = {"bedside table": rng.uniform(0.02, 0.15), "coffee table": rng.uniform(0.3, 0.55)}.get(
        group, rng.uniform(0.02, 0.22)
    )
    outward = np.array([side[0], 0.0, side[1]])
    faces_main = group not in {"bedside table", "coffee table"}
    yaw = yaw_main if not faces_main else math.atan2(*(turn @ -outward)[[0, 2]]) + float(rng.normal(0, 0.12))
    reach = (abs(outward) @ size) / 2 + gap + (item.size[2] if faces_main or side[1] else item.size[0]) / 2
    shift = outward * reach
    if faces_main:
        shift += outward[[2, 1, 0]] * float(rng.uniform(-0.3, 0.3)) * (abs(outward[[2, 1, 0]]) @ size)
    elif group == "bedside table":
        shift[2] = -size[2] / 2 + item.size[2] / 2
    foot = (main.low + main.high) / 2
    foot[1] = 0.0
    _commit(site, _place(site, index, foot + turn @ shift, yaw))


def _fill_surfaces(site: _Site) -> None:
    for anchor in range(len(site.placed)):
        rule = ON_TOP.get(site.placed[anchor].group)
        if rule is None or not rule[0] or site.rng.random() < 0.1:
            continue
        many = int(site.rng.integers(1, rule[1] + 2))
        for _ in range(many):
            index = _draw(site, rule[0])
            if index is not None and len(site.placed) < _MAX_INSTANCES - 10:
                _stand_on(site, anchor, index)


def _scatter_odds(site: _Site) -> None:
    """A few things that no rule asks for, each where it may be (`ODDS`)."""
    drawn = {PARAMETRIC, UNSEEN}
    known = [
        r for r in sorted(ODDS) if any(site.pack.items[i].library in drawn for i in site.roles.get(r, ()))
    ]
    if not known:
        return
    for _ in range(int(site.rng.integers(0, _MOST_ODDS + 1))):
        word = known[int(site.rng.integers(len(known)))]
        index = int(site.rng.choice([i for i in site.roles[word] if site.pack.items[i].library in drawn]))
        if ODDS[word] == "floor":
            _on_floor(site, index)
        elif ODDS[word] == "hang":
            _hang(site, index)
        elif tops := [n for n, placed in enumerate(site.placed) if placed.group in ON_TOP]:
            _stand_on(site, tops[int(site.rng.integers(len(tops)))], index)


def _stand_on(site: _Site, anchor: int, index: int, tries: int = 10) -> None:
    """Put a small thing where the surface below it is flat."""
    base, item = site.placed[anchor], site.pack.items[index]
    heights = site.pack.heights[base.item]
    cells = len(heights)
    size = np.array(site.pack.items[base.item].size)[[0, 2]]
    soft = base.group in {"bed", "sofa", "armchair", "chair"}
    spin = 0.4 if item.group in {"computer", "tv", "microwave", "speaker", "cushion"} else math.pi
    for _ in range(tries):
        turn = float(site.rng.uniform(-spin, spin))
        cos, sin = abs(math.cos(turn)), abs(math.sin(turn))
        need = np.array([item.size[0] * cos + item.size[2] * sin, item.size[0] * sin + item.size[2] * cos])
        free = size - need
        if np.any(free < 0):
            continue
        spot = (site.rng.random(2) - 0.5) * free
        first = np.floor(((spot - need / 2) / size + 0.5) * cells).astype(int).clip(0, cells - 1)
        last = np.floor(((spot + need / 2) / size + 0.5) * cells).astype(int).clip(0, cells - 1)
        patch = heights[first[1] : last[1] + 1, first[0] : last[0] + 1]
        if patch.min() < patch.max() - (0.08 if soft else 0.02) or patch.max() < 0.15:
            continue
        foot = base.model @ np.array([spot[0], patch.max() - (0.03 if soft else 0.0), spot[1], 1.0])
        if foot[1] > 1.75:
            continue
        yaw = math.atan2(base.model[0, 2], base.model[2, 2]) + turn
        if _commit(site, _place(site, index, foot[:3], yaw), anchor, openings=False) is not None:
            return
