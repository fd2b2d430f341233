"""The stored form of a scene's record: plain JSON values under stable keys.

What making the scene took (`Cost`) is read from files of version 1 and never written: it differs
from run to run, and equal photos are to give equal files. Keys that this version does not know are
read into `Record.others` and written back as they are.
"""

import math

from langflash_core.base.records import Cost, Record, Shift, world_from_json, world_to_json
from langflash_core.scene.tour import read_tour, told_tour

_COST = ("timings", "seconds", "peak_memory_mb")
_VERSION_1 = "gaussians_per_view"  # a tensor since
_TEXTS = ("photos", "warnings")
_MAPPINGS = (
    "counts", "pruning", "detail", "light", "lens", "left_out", "foreseen", "calibration",
)  # fmt: skip
_PLAIN: dict[str, tuple[type, ...]] = {
    "preset": (str,),
    "source": (str,),
    "metric_scale": (int, float),
    "network_unit": (int, float),
    **dict.fromkeys(_MAPPINGS, (dict,)),
}


def to_json(record: Record) -> dict:
    """What a file holds: every known thing that is known, in the order of `Record`, then the others."""
    known = {name: getattr(record, name) for name in (*_PLAIN, *_TEXTS)}
    known["atom_names"] = {str(k): name for k, name in record.atom_names.items()}
    known["atom_denials"] = {str(k): list(said) for k, said in record.atom_denials.items()}
    known["silent_atoms"] = record.silent_atoms
    known["lone_atoms"] = record.lone_atoms
    known["shift"] = record.shift
    known["world"] = None if record.world is None else world_to_json(record.world)
    known["thing_names"] = dict(record.thing_names)
    known["camera_path"] = record.camera_path
    known["tour"] = record.tour
    known["antialiased"] = record.antialiased or None
    known["layered"] = record.layered or None
    known["edits"] = {"deleted": record.num_deleted} if record.num_deleted else None
    written = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in known.items()
        if value not in (None, {}, ())
    }
    return {**written, **record.others}


def from_json(values: dict) -> Record:
    """The record of stored values.

    Raises:
        ValueError: names the key, what was expected, and what was received.
    """
    known = {name: _of_type(values, name, *types) for name, types in _PLAIN.items()}
    known |= {name: tuple(_list(values, name, str)) for name in _TEXTS}
    names = _of_type(values, "atom_names", dict) or {}
    denials = _of_type(values, "atom_denials", dict) or {}
    edits = _of_type(values, "edits", dict) or {}
    world, things = _of_type(values, "world", dict), _of_type(values, "thing_names", dict) or {}
    ours = {
        *known, "atom_names", "atom_denials", "silent_atoms", "lone_atoms", "edits", "camera_path", "tour",
        "world", "thing_names", "shift", "antialiased", "layered", _VERSION_1, *_COST,
    }  # fmt: skip
    return Record(
        **{name: value for name, value in known.items() if value is not None},
        atom_names={_number(k): str(name) for k, name in names.items()},
        atom_denials={_number(k): tuple(_list(denials, k, str)) for k in denials},
        silent_atoms=tuple(_list(values, "silent_atoms", int)),
        lone_atoms=tuple(_list(values, "lone_atoms", int)),
        world=None if world is None else world_from_json(world),
        shift=_shift(values),
        thing_names={str(thing): str(name) for thing, name in things.items()},
        camera_path=tuple(_list(values, "camera_path", dict)),
        tour=told_tour(read_tour(_of_type(values, "tour", dict) or {})),
        antialiased=_flag(values, "antialiased"),
        num_deleted=int(_of_type(edits, "deleted", int) or 0),
        layered=_flag(values, "layered"),
        cost=Cost(
            timings=_of_type(values, "timings", dict) or {},
            seconds=_of_type(values, "seconds", dict) or {},
            peak_memory_mb=_of_type(values, "peak_memory_mb", int),
        ),
        others={name: value for name, value in values.items() if name not in ours},
    )


def counts_per_view(values: dict) -> list[int]:
    """How many Gaussians each view made, in order, as files of version 1 say it; [] where they do not."""
    return _list(values, _VERSION_1, int)


def _shift(values: dict) -> Shift | None:
    found = _of_type(values, "shift", list)
    if found is None:
        return None
    if len(found) != 3 or not all(type(value) in (int, float) and math.isfinite(value) for value in found):
        raise ValueError(f"shift: expected three finite numbers, received {found!r}")
    x, y, z = map(float, found)
    return x, y, z


def _of_type(values: dict, name: str, *types: type):
    """A value of one of these types, or None where there is none."""
    value = values.get(name)
    if value is None or (isinstance(value, types) and not isinstance(value, bool)):
        return value
    expected = " or ".join(kind.__name__ for kind in types)
    raise ValueError(f"{name}: expected {expected}, received {value!r}")


def _flag(values: dict, name: str) -> bool:
    value = values.get(name, False)
    if isinstance(value, bool):
        return value
    raise ValueError(f"{name}: expected true or false, received {value!r}")


def _list(values: dict, name: str, kind: type) -> list:
    found = _of_type(values, name, list) or []
    if not all(isinstance(value, kind) and not isinstance(value, bool) for value in found):
        raise ValueError(f"{name}: expected a list of {kind.__name__}, received {found!r}")
    return found


def _number(key: str) -> int:
    if not key.isdecimal():
        raise ValueError(f"atom_names: expected numbers of atoms, received {key!r}")
    return int(key)
