"""All furniture meshes in one compact file. N vertices, F triangles, L texture layers.

Positions are 16-bit fractions of each item's box, normals 8-bit, textures small JPEG or PNG files.
Built once (minutes), loaded in a second, drawn from one vertex buffer.
"""

import io
import json
import lzma
import zipfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.errors import InputError
from langflash_core.lab.rooms.builtin import KIND_PLAIN, LIBRARY, builtin_models
from langflash_core.lab.rooms.catalogue import UNSEEN, Archive, Item, default_materials, load_catalogue
from langflash_core.lab.rooms.mesh import Mesh, index, pose
from langflash_core.lab.rooms.objfile import PANE, Material, Soup, parse_mtl, parse_obj
from langflash_core.lab.rooms.parametric import parametric_models, wood_textures

FORMAT = 1
TEXTURE_SIZE = 128
MAX_SOURCE_FACES = 130_000
MAX_FACES = 4_500
_PANE_OPACITY = 0.4
_UNSEEN_SHARE = 0.5  # of as many makes as are trained on: enough to validate, and the file stays small


@dataclass(frozen=True)
class Pack:
    """Furniture, ready to upload.

    Attributes:
        items: catalogue entries, in the order of the ranges.
        vertex_ranges: first vertex and count per item.
        face_ranges: first face and count per item.
        positions: metres, in the item's own frame (foot at y = 0, x and z centred).
        normals: unit.
        uvs: texture coordinates.
        material_ids: row of the material table, per vertex.
        faces: global vertex indices.
        material_table: sRGB colour and opacity; texture layer (-1: none), gloss, shader kind, 0.
        textures: sRGB layers with coverage in alpha.
        heights: surface height maps (z rows, x columns), m.
    """

    items: tuple[Item, ...]
    vertex_ranges: Int[np.ndarray, "I 2"]
    face_ranges: Int[np.ndarray, "I 2"]
    positions: Float[np.ndarray, "N 3"]
    normals: Float[np.ndarray, "N 3"]
    uvs: Float[np.ndarray, "N 2"]
    material_ids: Int[np.ndarray, " N"]
    faces: Int[np.ndarray, "F 3"]
    material_table: Float[np.ndarray, "M 2 4"]
    textures: UInt8[np.ndarray, "L S S 4"]
    heights: Float[np.ndarray, "I R R"]

    def select(self, libraries: Iterable[str]) -> tuple[int, ...]:
        """Indices of the items of some libraries; models made here belong to all."""
        allowed = {*libraries, LIBRARY}
        return tuple(i for i, item in enumerate(self.items) if item.library in allowed)


@dataclass
class _Draft:
    """A pack in the making: lists that grow item by item."""

    items: list[Item] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[tuple[float, ...]] = field(default_factory=list)
    textures: list[bytes] = field(default_factory=list)
    texture_ids: dict[bytes, int] = field(default_factory=dict)


def build_pack(
    root: Path,
    out: Path,
    keys: frozenset[str] | None = None,
    max_faces: int = MAX_FACES,
    copies: float = 1.0,
) -> int:
    """Pack the catalogues under a folder.

    Args:
        root: folder with the libraries (see `load_catalogue`).
        out: file to write, `.npz`, atomically.
        keys: items to keep; all when None. Models made here are always kept.
        max_faces: decimate larger models to about this many triangles.
        copies: share of the makes drawn by rules (see `parametric_models`).

    Returns:
        Number of items packed. Models that cannot be read, or are larger than any decimation
        can help, are left out.
    """
    catalogue = load_catalogue(root)
    members = {library: archive.members() for library, archive in catalogue.archives.items()}
    draft = _Draft()
    for model in builtin_models():
        soup = pose(model.soup, model.item.size, model.item.rotation)
        looks = [model.materials[name] for name in soup.material_names]
        _append(draft, model.item, index(soup, max_faces), [_row(look, -1, kind) for look, kind in looks])
    for item in catalogue.items:
        if keys is None or item.key in keys:
            _add_item(draft, item, catalogue.archives[item.library], members[item.library], max_faces)
    if keys is None:
        _add_parametric(draft, max_faces, copies)
    _write(draft, out)
    return len(draft.items)


def load_pack(path: Path) -> Pack:
    """Read a pack.

    Raises:
        InputError: missing, or not a pack of this version.
    """
    if not path.is_file():
        raise InputError(f"there is no room pack at {path}; build one with `langflash lab rooms pack`")
    try:
        with path.open("rb") as file, np.load(file) as arrays:
            stored = {name: arrays[name] for name in arrays.files}
        header = json.loads(stored["header"].tobytes())
    except (ValueError, KeyError, OSError, zipfile.BadZipFile, lzma.LZMAError) as error:
        raise InputError(f"{path} is not a room pack; build one with `langflash lab rooms pack`") from error
    if header["format"] != FORMAT:
        raise InputError(f"{path} has pack format {header['format']}, expected {FORMAT}; build it again")
    return _decode(stored, tuple(_item_from(entry) for entry in header["items"]))


def _add_item(draft: _Draft, item: Item, archive: Archive, members: dict[str, str], max_faces: int) -> None:
    try:
        text = archive.read(members[item.model.lower()]).decode("latin-1")
        soup, libraries = parse_obj(text)
    except (KeyError, ValueError):
        return
    if len(soup.positions) > MAX_SOURCE_FACES:
        return
    soup = pose(soup, item.size, item.rotation)
    folder = item.model.rpartition("/")[0]
    looks = _materials(soup, libraries, folder, archive, members)
    rows = [_row(look, _texture(draft, look, folder, archive, members), KIND_PLAIN) for look in looks]
    _append(draft, item, index(soup, max_faces), rows)


def _add_parametric(draft: _Draft, max_faces: int, copies: float) -> None:
    layers = {name: _layer(draft, encoded) for name, encoded in wood_textures().items()}
    made = [*parametric_models(copies), *parametric_models(copies * _UNSEEN_SHARE, UNSEEN)]
    for item, soup, looks in made:
        rows = [_row(look, layers.get(look.texture, -1), kind) for look, kind in looks]
        _append(draft, item, index(pose(soup, item.size, item.rotation), max_faces), rows)


def _layer(draft: _Draft, encoded: bytes) -> int:
    """The layer of a texture file of the right size, stored once."""
    if encoded not in draft.texture_ids:
        draft.texture_ids[encoded] = len(draft.textures)
        draft.textures.append(encoded)
    return draft.texture_ids[encoded]


def _materials(
    soup: Soup, libraries: tuple[str, ...], folder: str, archive: Archive, members: dict[str, str]
) -> list[Material]:
    table: dict[str, Material] = {}
    for library in libraries:
        member = members.get(f"{folder}/{library}".lower())
        if member:
            table.update(parse_mtl(archive.read(member).decode("latin-1")))
    named = {name.lower(): Material(colour) for name, colour in default_materials().items()}
    looks = []
    for name in soup.material_names:
        plain = name.removesuffix(PANE)
        look = table.get(plain) or named.get(plain.lower(), Material())
        looks.append(look if plain == name else replace(look, opacity=min(look.opacity, _PANE_OPACITY)))
    return looks


def _texture(draft: _Draft, look: Material, folder: str, archive: Archive, members: dict[str, str]) -> int:
    """Layer of a material's texture, encoded once; -1 when it has none that can be read."""
    names = (
        (look.texture, look.texture.rpartition(" ")[2]) if look.texture else ()
    )  # some name a path with spaces
    found = [members[f"{folder}/{name}".lower()] for name in names if f"{folder}/{name}".lower() in members]
    if not found:
        return -1
    member = found[0]
    try:
        with opened_picture(archive.read(member)) as opened:
            image = opened.convert("RGBA")
    except OSError:
        return -1
    image = image.resize((TEXTURE_SIZE, TEXTURE_SIZE), Image.Resampling.BOX)
    stream = io.BytesIO()
    if np.asarray(image)[..., 3].min() < 250:
        image.save(stream, "PNG", optimize=True)
    else:
        image.convert("RGB").save(stream, "JPEG", quality=85)
    return _layer(draft, stream.getvalue())


def _row(look: Material, layer: int, kind: int) -> tuple[float, ...]:
    colour = (1.0, 1.0, 1.0) if layer >= 0 else look.colour
    return (*colour, look.opacity, float(layer), look.gloss, float(kind), 0.0)


def _append(draft: _Draft, item: Item, mesh: Mesh, rows: list[tuple[float, ...]]) -> None:
    if not len(mesh.faces) or len(mesh.positions) > 65_535:
        return
    first = len(draft.materials)
    draft.items.append(item)
    draft.meshes.append(replace(mesh, materials=mesh.materials + first))
    draft.materials.extend(rows)


def _write(draft: _Draft, out: Path) -> None:
    meshes = draft.meshes
    sizes = [np.maximum(np.array(item.size), 1e-6) for item in draft.items]
    offset = np.array([0.5, 0.0, 0.5])
    fractions = [np.clip(m.positions / s + offset, 0, 1) for m, s in zip(meshes, sizes, strict=True)]
    header = {"format": FORMAT, "items": [asdict(item) for item in draft.items]}
    arrays = {
        "header": np.frombuffer(json.dumps(header, ensure_ascii=False).encode(), dtype=np.uint8),
        "vertex_counts": np.array([len(m.positions) for m in meshes], dtype=np.int32),
        "face_counts": np.array([len(m.faces) for m in meshes], dtype=np.int32),
        "positions": np.round(np.concatenate(fractions) * 65_535).astype(np.uint16),
        "normals": np.round(np.concatenate([m.normals for m in meshes]) * 127).astype(np.int8),
        "uvs": np.concatenate([_wrap(m.uvs) for m in meshes]).astype(np.float16),
        "material_ids": np.concatenate([m.materials for m in meshes]).astype(np.uint16),
        "faces": np.concatenate([m.faces for m in meshes]).astype(np.uint16),
        "material_table": np.array(draft.materials, dtype=np.float32).reshape(-1, 2, 4),
        "texture_bytes": np.frombuffer(b"".join(draft.textures), dtype=np.uint8),
        "texture_sizes": np.array([len(t) for t in draft.textures], dtype=np.int32),
        "heights": np.stack([m.heights for m in meshes]).astype(np.float16),
    }
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_LZMA) as archive:  # a quarter smaller than numpy's deflate
        for name, array in arrays.items():
            part = io.BytesIO()
            np.save(part, array)
            archive.writestr(f"{name}.npy", part.getvalue())
    make_folder(out.parent)
    write_atomically(out, stream.getvalue())


def _wrap(uvs: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
    """Shift by whole turns towards 0: half precision is fine only for small coordinates."""
    return np.clip(uvs - np.round(np.median(uvs, axis=0)), -1_000.0, 1_000.0)


def _item_from(entry: dict[str, Any]) -> Item:
    fields: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()
    }
    return Item(**fields)


def _decode(stored: dict[str, np.ndarray], items: tuple[Item, ...]) -> Pack:
    vertices, faces = (_ranges(stored[name]) for name in ("vertex_counts", "face_counts"))
    sizes = np.repeat(np.array([item.size for item in items]), vertices[:, 1], axis=0)
    fractions = stored["positions"].astype(np.float32) / 65_535
    first = np.repeat(vertices[:, 0], faces[:, 1])
    return Pack(
        items=items,
        vertex_ranges=vertices,
        face_ranges=faces,
        positions=((fractions - [0.5, 0.0, 0.5]) * sizes).astype(np.float32),
        normals=stored["normals"].astype(np.float32) / 127,
        uvs=stored["uvs"].astype(np.float32),
        material_ids=stored["material_ids"].astype(np.int32),
        faces=(stored["faces"].astype(np.int32) + first[:, None]).astype(np.int32),
        material_table=stored["material_table"],
        textures=_decode_textures(stored["texture_bytes"], stored["texture_sizes"]),
        heights=stored["heights"].astype(np.float32),
    )


def _ranges(counts: Int[np.ndarray, " I"]) -> Int[np.ndarray, "I 2"]:
    return np.stack([np.cumsum(counts) - counts, counts], axis=1)


def _decode_textures(
    joined: UInt8[np.ndarray, " Z"], sizes: Int[np.ndarray, " L"]
) -> UInt8[np.ndarray, "T S S 4"]:
    """T = max(L, 1) square layers: a texture array cannot be empty."""
    layers = np.zeros((max(len(sizes), 1), TEXTURE_SIZE, TEXTURE_SIZE, 4), dtype=np.uint8)
    starts = np.cumsum(sizes) - sizes
    for layer, (start, size) in enumerate(zip(starts, sizes, strict=True)):
        with opened_picture(joined[start : start + size].tobytes(), STORED) as image:
            layers[layer] = np.asarray(image.convert("RGBA"))[::-1]  # row 0 is v = 0
    return layers
