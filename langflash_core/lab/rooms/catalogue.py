"""The furniture catalogues of Sweet Home 3D, as labelled items. Lengths in metres.

Two sources: libraries (`*.sh3f`, zip or unpacked folder) and the default catalogue inside
`sweethome3d.jar`. A catalogue says name, tags, size and pose of a model; what class a model
belongs to, and which models are unusable, is our own table in `tables/`.
"""

import json
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

PARAMETRIC = "parametric"
"""Models that rules draw (`parametric`); like a library, but made here."""
TRAIN_LIBRARIES = ("default", "Scopia", "BlendSwap-CC-BY", "KatorLegaz", "Reallusion", PARAMETRIC)
UNSEEN = "parametric-unseen"
"""Models that the same rules draw from other seeds."""
VALIDATION_LIBRARIES = (UNSEEN,)
HELD_OUT_LIBRARIES = ("BlendSwap-CC-0",)

_TABLES = Path(__file__).resolve().parent / "tables"
_PLUGIN = "PluginFurnitureCatalog.properties"
_DEFAULT = "com/eteks/sweethome3d/io/DefaultFurnitureCatalog.properties"
_OUTSIDE = frozenset({"Exterior", "Vehicles", "Staircases"})
_CM = 0.01


@dataclass(frozen=True)
class Item:
    """One model of a catalogue.

    Attributes:
        key: unique id, "id|library".
        library: name of the library that holds it.
        name: cleaned catalogue name, lower case.
        tags: cleaned synonyms, lower case.
        category: the catalogue's own category.
        group: class group in plain words ("chair").
        size: (width x, height y, depth z), m.
        elevation: usual height of its foot above the floor, m.
        surface: height of the top on which things stand, m; below 0 when there is none.
        opening: True for doors and windows.
        wall_front: openings only: where the wall's inner face cuts the depth, as a fraction from the back.
        light: True for lamps that shine.
        rotation: row-major 3x3 model rotation.
        creator: author, for attribution.
        model: path of the OBJ inside its archive.
    """

    key: str
    library: str
    name: str
    tags: tuple[str, ...]
    category: str
    group: str
    size: tuple[float, float, float]
    elevation: float
    surface: float
    opening: bool
    wall_front: float
    light: bool
    rotation: tuple[float, ...]
    creator: str
    model: str

    @property
    def names(self) -> tuple[str, ...]:
        """Name, group and synonyms, without duplicates; the catalogue name first."""
        return tuple(dict.fromkeys((self.name, *self.tags, self.group)))


@dataclass(frozen=True)
class Archive:
    """A zip file or an unpacked folder, read by member name."""

    path: Path

    def members(self) -> dict[str, str]:
        """Lower-case member name -> true name; models refer to files in any case."""
        if self.path.is_dir():
            files = (p for p in self.path.rglob("*") if p.is_file())
            return {
                p.relative_to(self.path).as_posix().lower(): p.relative_to(self.path).as_posix()
                for p in files
            }
        with zipfile.ZipFile(self.path) as archive:
            return {name.lower(): name for name in archive.namelist()}

    def read(self, member: str) -> bytes:
        """Bytes of one member.

        Raises:
            KeyError, FileNotFoundError: there is no such member.
        """
        if self.path.is_dir():
            return (self.path / member).read_bytes()
        with zipfile.ZipFile(self.path) as archive:
            return archive.read(member)


@dataclass(frozen=True)
class Catalogue:
    """All usable items and the archives that hold their models."""

    items: tuple[Item, ...]
    archives: dict[str, Archive]


def load_catalogue(root: Path) -> Catalogue:
    """Every usable indoor item under a folder.

    Args:
        root: folder that holds `*.sh3f` (files or unpacked folders) and `sweethome3d.jar`.

    Returns:
        Items of all libraries found, in a stable order.

    Raises:
        ValueError: no library was found.
    """
    archives = _find_archives(root)
    if not archives:
        raise ValueError(f"root: expected *.sh3f or sweethome3d.jar under {root}, found none")
    items = [item for library, archive in archives.items() for item in _library_items(library, archive)]
    return Catalogue(tuple(items), archives)


def parse_properties(text: str) -> dict[str, str]:
    r"""Java properties: `key=value`, `#` comments, `\uXXXX` escapes, `\` line ends."""
    text = re.sub(r"\\\r?\n\s*", "", text)
    pairs = {}
    for line in text.splitlines():
        key, equals, value = line.strip().partition("=")
        if equals and not key.startswith(("#", "!")):
            pairs[key.strip()] = re.sub(r"\\u([0-9a-fA-F]{4})", lambda m: chr(int(m[1], 16)), value.strip())
    return pairs


def clean_name(name: str) -> str:
    """Plain lower-case words: "Bed 140x190" -> "bed"."""
    return _plain(labels()["name_fixes"].get(name, name))


def _plain(words: str) -> str:
    return " ".join(re.sub(r"\b\d+(x\d+)?\b|[&:,()]", " ", words).lower().split())


@cache
def labels() -> dict:
    """Our table of exclusions, name repairs and class groups."""
    return json.loads((_TABLES / "labels.json").read_text(encoding="utf-8"))


@cache
def _id_groups() -> dict[str, str | None]:
    return json.loads((_TABLES / "groups.json").read_text(encoding="utf-8"))


@cache
def default_materials() -> dict[str, tuple[float, float, float]]:
    """Colours of the material names that models use without an MTL file; sRGB, lower-case names."""
    table = json.loads((_TABLES / "default_materials.json").read_text(encoding="utf-8"))
    return {name.lower(): tuple(colour[:3]) for name, colour in table.items()}


def _find_archives(root: Path) -> dict[str, Archive]:
    found = {}
    for path in sorted(root.rglob("*.sh3f")) + sorted(p.parent for p in root.rglob(_PLUGIN)):
        found[path.stem] = Archive(path)
    for path in sorted(root.rglob("sweethome3d.jar")):
        found["default"] = Archive(path)
    for path in sorted(root.rglob(Path(_DEFAULT).name)):
        found["default"] = Archive(path.parents[4])
    return {
        library: found[library] for library in (*TRAIN_LIBRARIES, *HELD_OUT_LIBRARIES) if library in found
    }


def _library_items(library: str, archive: Archive) -> Iterator[Item]:
    text = archive.read(_DEFAULT if library == "default" else _PLUGIN).decode("latin-1")
    table = parse_properties(text)
    count = 1
    while f"id#{count}" in table:
        fields = {key.rpartition("#")[0]: value for key, value in table.items() if key.endswith(f"#{count}")}
        group = _group_of(fields, library)
        if group:
            yield _item(fields, library, group)
        count += 1


def _group_of(fields: dict[str, str], library: str) -> str:
    """Class group in plain words; "" when the model is not used indoors."""
    table, name = labels(), fields["name"]
    if name in table["exclude_names"] or name.endswith("light source"):
        return ""
    outside = fields["category"] in _OUTSIDE
    if outside and name not in table["exterior_indoors"] and name not in table["misc_indoors"]:
        return ""
    group = table["name_groups"].get(name) or _id_groups().get(f"{fields['id']}|{library}")
    if group is None and f"{fields['id']}|{library}" not in _id_groups():
        last = clean_name(name).split(" ")[-1]  # a model newer than our table
        group = last if last in _id_groups().values() else None
    return table["group_words"].get(group, group) if group else ""


def _item(fields: dict[str, str], library: str, group: str) -> Item:
    width, height, depth = (float(fields[k]) * _CM for k in ("width", "height", "depth"))
    top = float(fields.get("dropOnTopElevation", fields["height"])) * _CM
    rotation = tuple(float(v) for v in fields.get("modelRotation", "1 0 0 0 1 0 0 0 1").split())
    return Item(
        key=f"{fields['id']}|{library}",
        library=library,
        name=clean_name(fields["name"]),
        tags=_clean_tags(fields.get("tags", "")),
        category=fields["category"],
        group=group,
        size=(width, height, depth),
        elevation=float(fields.get("elevation", 0.0)) * _CM,
        surface=top,
        opening=fields.get("doorOrWindow") == "true",
        wall_front=_wall_front(fields),
        light="lightSourceX" in fields,
        rotation=rotation if len(rotation) == 9 else tuple(np.eye(3).ravel()),
        creator=fields.get("creator", "unknown"),
        model=fields["model"].lstrip("/"),
    )


def _wall_front(fields: dict[str, str]) -> float:
    if "doorOrWindowWallThickness" not in fields:
        return 0.8
    front = float(fields["doorOrWindowWallThickness"]) + float(fields.get("doorOrWindowWallDistance", 0.0))
    return min(front / max(float(fields["depth"]), 1e-6), 1.0)


def _clean_tags(tags: str) -> tuple[str, ...]:
    words = (_plain(tag) for tag in tags.split(","))
    stop = labels()["tag_stopwords"]
    return tuple(dict.fromkeys(w for w in words if w and w not in stop and len(w) > 1))
