"""Whole glTF files with what this program has never seen: read to the same Gaussians, or refused by name.

Damaged files are in `test_mutations.py`. Here every file is one that glTF 2.0 allows: things are added that a
reader may pass over (`HARMLESS`), or must not (`NEEDED`), one at a time and several together.
"""

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote, quote_from_bytes

import numpy as np
import pytest
import torch

from langflash_core.errors import SceneFileError
from langflash_core.export import export, read
from langflash_core.export.gltf_document import glb_head
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Gaussians
from tests.export.splats import random_gaussians, refusal, same

SPLATS = "KHR_gaussian_splatting"
REPEATS = "EXT_mesh_gpu_instancing"
COUNT = 40
GAUSSIANS = random_gaussians(COUNT, 1)
ALIEN = {"deep": [1, {"é": None}], "bufferView": 99, "KHR_gaussian_splatting": {}}


class File:
    """A glTF file that can be changed: its JSON, the bytes of its own buffer, and files beside it."""

    def __init__(self, folder: Path, gaussians: Gaussians = GAUSSIANS):
        export(bare_scene(gaussians, "made"), folder / "plain.glb")
        content = (folder / "plain.glb").read_bytes()
        size = struct.unpack_from("<I", content, 12)[0]
        self.json: dict[str, Any] = json.loads(content[20 : 20 + size])
        self.buffer, self.folder, self.more = content[28 + size :], folder, b""

    @property
    def primitive(self) -> dict[str, Any]:
        """Of the Gaussians."""
        return next(
            primitive
            for mesh in self.json["meshes"]
            for primitive in mesh["primitives"]
            if SPLATS in primitive.get("extensions", {})
        )

    @property
    def roots(self) -> list[int]:
        """Nodes of the scene that is shown."""
        return self.json["scenes"][self.json["scene"]]["nodes"]

    def accessor(self, name: str) -> dict[str, Any]:
        return self.json["accessors"][self.primitive["attributes"][name]]

    def values(self, name: str) -> np.ndarray:
        """Rows of a float32 attribute."""
        described = self.accessor(name)
        view, width = self.json["bufferViews"][described["bufferView"]], int(described["type"][-1])
        start = view.get("byteOffset", 0) + described.get("byteOffset", 0)
        strides = (view.get("byteStride", 4 * width), 4)
        return np.ndarray((described["count"], width), "<f4", self.buffer, start, strides).copy()

    def add_view(self, content: bytes, **more: Any) -> int:
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(content), **more}
        self.json["bufferViews"].append(view)
        self.buffer += content
        return len(self.json["bufferViews"]) - 1

    def add_accessor(self, values: np.ndarray, component: int, kind: str, **more: Any) -> int:
        view = self.add_view(values.tobytes())
        own = {"bufferView": view, "componentType": component, "count": len(values), "type": kind, **more}
        self.json["accessors"].append(own)
        return len(self.json["accessors"]) - 1

    def use(self, *names: str) -> None:
        self.json["extensionsUsed"] = [*self.json["extensionsUsed"], *names]

    def written(self, form: str = "glb") -> Path:
        """form: "glb", "file", "base64" or "percent": where the buffer lies."""
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.json["buffers"][0]["byteLength"] = len(self.buffer)
        path = self.folder / ("b.glb" if form == "glb" else "b.gltf")
        if form == "glb":
            body = glb_head(self.json, len(self.buffer)) + self.buffer + self.more
            path.write_bytes(body[:8] + struct.pack("<I", len(body)) + body[12:])
            return path
        if form == "file":
            (self.folder / "Möbel 1%.bin").write_bytes(self.buffer)
        kind = "data:application/octet-stream"
        self.json["buffers"][0]["uri"] = {
            "file": "./" + quote("Möbel 1%.bin"),
            "base64": f"{kind};base64,{quote(base64.b64encode(self.buffer).decode())}",
            "percent": f"{kind},{quote_from_bytes(self.buffer)}",
        }[form]
        path.write_text(json.dumps(self.json, indent=1), "utf-8")
        return path


def used_everywhere(file: File, rng: np.random.Generator) -> None:
    """An extension that is only used may be on anything, and is passed over."""
    file.use("ACME_everything")
    lists = ("nodes", "meshes", "accessors", "bufferViews", "buffers", "scenes")
    for entry in (file.json, file.json["asset"], file.primitive, *(e for k in lists for e in file.json[k])):
        if "EXT_meshopt_compression" not in entry.get("extensions", {}):
            entry.setdefault("extensions", {})["ACME_everything"] = ALIEN
        entry["extras"] = ALIEN


def alien_members(file: File, rng: np.random.Generator) -> None:
    file.json |= {"acme": ALIEN, "extras": [1, 2, {"x": ALIEN}], "animations": [], "skins": [], "cameras": []}
    file.json["asset"] |= {"minVersion": "2.0", "copyright": "nobody", "generator": "Möbel"}


def other_attributes(file: File, rng: np.random.Generator) -> None:
    numbers = rng.normal(size=(COUNT, 2)).astype("<f4")
    for name in ("_FEATURE_ID_0", "TEXCOORD_0", "ACME_paint:GLOSS"):
        file.primitive["attributes"][name] = file.add_accessor(numbers, 5126, "VEC2")
    del file.primitive["attributes"]["COLOR_0"]


def other_buffers(file: File, rng: np.random.Generator) -> None:
    """Not read, so not there: of pictures and compressed meshes."""
    file.json["buffers"] += [
        {"byteLength": 9000, "uri": "https://acme.example/picture.bin"},
        {"byteLength": 4, "uri": "data:application/octet-stream,%00%01%02%03"},
        {"byteLength": 600, "extensions": {"EXT_meshopt_compression": {"fallback": True}}},
    ]
    file.json["bufferViews"].append({"buffer": 1, "byteLength": 9000})
    file.json["images"] = [{"bufferView": len(file.json["bufferViews"]) - 1, "mimeType": "image/ktx2"}]


def a_mesh_beside(file: File, rng: np.random.Generator) -> None:
    """Triangles, compressed ones too, morphed and skinned, before the Gaussians."""
    corners = file.add_accessor(rng.normal(size=(3, 3)).astype("<f4"), 5126, "VEC3")
    file.json["accessors"].append({"componentType": 5126, "count": 3, "type": "VEC3"})
    empty = len(file.json["accessors"]) - 1
    plain = {"attributes": {"POSITION": corners}, "targets": [{"POSITION": corners}], "material": 0}
    draco = {
        "attributes": {"POSITION": empty},
        "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0}},
    }
    file.use("KHR_draco_mesh_compression")
    file.json["materials"] = [{"extensions": {"KHR_materials_unlit": {}}}]
    file.json["skins"] = [{"joints": [0]}]
    file.json["meshes"].append({"primitives": [plain, draco], "weights": [1.0]})
    mesh = len(file.json["meshes"]) - 1
    file.json["nodes"].append({"mesh": mesh, "skin": 0, "scale": [1, 2, 3], "weights": [0.5]})
    file.roots.insert(0, len(file.json["nodes"]) - 1)


def other_nodes(file: File, rng: np.random.Generator) -> None:
    """Empty ones, a camera, a light; the Gaussians below two that do not move them."""
    nodes, last = file.json["nodes"], len(file.json["nodes"])
    nodes += [
        {"name": "empty"},
        {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"children": list(file.roots), "matrix": np.eye(4).reshape(-1).tolist()},
        {"children": [last + 2, last, last + 1], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]},
    ]
    file.roots[:] = [last + 3]


def other_scenes(file: File, rng: np.random.Generator) -> None:
    """The scene that is named is shown, not the first."""
    file.json["nodes"].append({**file.json["nodes"][0], "translation": [1, 2, 3]})
    file.json["scenes"].insert(0, {"nodes": [len(file.json["nodes"]) - 1], "name": "elsewhere"})
    file.json["scene"] = file.json.get("scene", 0) + 1


def hidden_ones(file: File, rng: np.random.Generator) -> None:
    """A second set of Gaussians that is said to be hidden, and one that is said not to be."""
    file.use("KHR_node_visibility")
    hidden = {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": False}}}
    file.json["nodes"] += [hidden, {"children": [len(file.json["nodes"])], "name": "inside"}]
    shown = file.json["nodes"][file.roots[-1]]
    shown.setdefault("extensions", {})["KHR_node_visibility"] = {"visible": True}
    file.roots.append(len(file.json["nodes"]) - 1)
    file.roots.reverse()


def interleaved(file: File, rng: np.random.Generator) -> None:
    """Two attributes in one view, row by row, with room between them."""
    names = ("POSITION", f"{SPLATS}:SCALE")
    if any("sparse" in file.accessor(name) for name in names):
        return
    rows = np.zeros((COUNT, 8), "<f4")
    rows[:, 1:4], rows[:, 5:8] = (file.values(name) for name in names)
    view = file.add_view(rows.tobytes(), byteStride=32)
    for place, name in ((4, names[0]), (20, names[1])):
        file.accessor(name).update(bufferView=view, byteOffset=place)


def sparse(file: File, rng: np.random.Generator) -> None:
    """Every third row of an attribute lies elsewhere, in bytes or shorts that say which."""
    name = str(rng.choice(["POSITION", f"{SPLATS}:ROTATION", f"{SPLATS}:SH_DEGREE_1_COEF_1"]))
    described = file.accessor(name)
    if "sparse" in described:
        return
    values = file.values(name)
    places = np.arange(0, COUNT, 3)
    component, kind = ((5121, "u1"), (5123, "<u2"))[rng.integers(2)]
    base = values.copy()
    base[places] = 1e6
    described.update(bufferView=file.add_view(base.tobytes()), byteOffset=0)
    described["sparse"] = {
        "count": len(places),
        "indices": {"bufferView": file.add_view(places.astype(kind).tobytes()), "componentType": component},
        "values": {"bufferView": file.add_view(values[places].tobytes())},
    }


def indices(file: File, rng: np.random.Generator) -> None:
    """Rows in an order of their own, undone by the indices."""
    component, kind = ((5121, "u1"), (5123, "<u2"), (5125, "<u4"))[rng.integers(3)]
    file.primitive["indices"] = file.add_accessor(np.arange(COUNT, dtype=kind), component, "SCALAR")


def more_chunks(file: File, rng: np.random.Generator) -> None:
    """Chunks of an unknown type, and a second one of the buffer's, behind the first."""
    for kind in (b"ACME", b"BIN\0"):
        file.more += struct.pack("<I", 8) + kind + bytes(8)


HARMLESS: tuple[Callable[[File, np.random.Generator], None], ...] = (
    used_everywhere, alien_members, other_attributes, other_buffers, a_mesh_beside, other_nodes, other_scenes,
    hidden_ones, interleaved, sparse, indices, more_chunks,
)  # fmt: skip


def required(file: File) -> None:
    file.use("ACME_shape")
    file.json["extensionsRequired"] = [SPLATS, "ACME_shape"]


def compressed_views(file: File) -> None:
    """As meshoptimizer's packers write it, and not even required: the second buffer has no bytes."""
    file.use("EXT_meshopt_compression")
    fallback = {"EXT_meshopt_compression": {"fallback": True}}
    file.json["buffers"].append({"byteLength": len(file.buffer), "extensions": fallback})
    for view in file.json["bufferViews"]:
        packed = {"buffer": 0, "byteLength": view["byteLength"], "mode": "ATTRIBUTES", "count": COUNT}
        view["extensions"] = {"EXT_meshopt_compression": {**packed, "byteStride": 12}}
        view["buffer"] = len(file.json["buffers"]) - 1


def compressed_primitive(file: File) -> None:
    file.use("KHR_draco_mesh_compression")
    file.primitive["extensions"]["KHR_draco_mesh_compression"] = {"bufferView": 0, "attributes": {}}
    for accessor in file.json["accessors"]:
        accessor.pop("bufferView", None)


def elsewhere(file: File, **more: str) -> None:
    file.json["buffers"].append({"byteLength": len(file.buffer), **more})
    view = file.json["bufferViews"][file.accessor("POSITION")["bufferView"]]
    view["buffer"] = len(file.json["buffers"]) - 1


def node_of(file: File) -> dict[str, Any]:
    mesh = next(i for i, m in enumerate(file.json["meshes"]) if file.primitive in m["primitives"])
    return next(n for n in file.json["nodes"] if n.get("mesh") == mesh)


def morphed(file: File) -> None:
    node_of(file)["weights"] = [0.5]
    file.primitive["targets"] = [{"POSITION": file.primitive["attributes"]["POSITION"]}]


NEEDED: tuple[tuple[Callable[[File], object], str], ...] = (
    (required, "needs ACME_shape, which this program does not know"),
    (compressed_views, "compressed (EXT_meshopt_compression)"),
    (compressed_primitive, "KHR_draco_mesh_compression"),
    (lambda f: f.primitive["extensions"][SPLATS].update(extensions={"ACME_packed": {}}), "ACME_packed"),
    (lambda f: f.primitive["attributes"].update({f"{SPLATS}:LOBE_0": 0}), f"{SPLATS}:LOBE_0"),
    (lambda f: f.primitive["attributes"].pop(f"{SPLATS}:ROTATION"), f"without {SPLATS}:ROTATION"),
    (lambda f: f.accessor("POSITION").update(componentType=5131), "type 5131"),
    (elsewhere, "has no bytes"),  # only buffer 0 is the binary chunk
    (lambda f: elsewhere(f, uri="gone%20away.bin"), "'gone away.bin'"),
    (lambda f: elsewhere(f, uri="%2E%2E%2Fplain.glb"), "elsewhere"),
    (lambda f: node_of(f).update(skin=0), "a skin"),
    (morphed, "morph targets"),
    (lambda f: node_of(f).update(extensions={REPEATS: {"attributes": {}}}), REPEATS),
    (lambda f: f.json["asset"].update(minVersion="2.1"), "glTF 2.1"),
    (lambda f: node_of(f).update(scale=[1, 2, 1]), "unevenly"),
)


@pytest.fixture
def plain(tmp_path) -> Gaussians:
    return read(File(tmp_path).written()).gaussians


@pytest.mark.parametrize("form", ["glb", "file", "base64", "percent"])
@pytest.mark.parametrize("added", HARMLESS, ids=lambda added: added.__name__)
def test_what_may_be_passed_over_is(tmp_path, plain, added, form):
    file = File(tmp_path)
    added(file, np.random.default_rng(1))
    found = read(file.written(form))
    assert same(found.gaussians, plain) and not found.record.warnings


@pytest.mark.parametrize("seed", range(40))
def test_many_at_once(tmp_path, plain, seed):
    """Two to seven, in any order; into the odd ones something that is needed is put besides."""
    rng = np.random.default_rng(seed)
    file = File(tmp_path)
    for place in rng.permutation(len(HARMLESS))[: rng.integers(2, 8)]:
        HARMLESS[place](file, rng)
    needed, word = NEEDED[seed // 2 % len(NEEDED)]
    if seed % 2:
        needed(file)
    path = file.written(str(rng.choice(["glb", "file", "base64", "percent"])))
    if seed % 2:
        assert word in refusal(lambda: read(path))
    else:
        assert same(read(path).gaussians, plain)


@pytest.mark.parametrize(("needed", "word"), NEEDED, ids=[word for _, word in NEEDED])
def test_what_is_needed_is_refused_by_name(tmp_path, needed, word):
    file = File(tmp_path)
    needed(file)
    said = refusal(lambda: read(file.written()))
    assert word in said and said.startswith("b.glb ")


def test_indices_choose_rows(tmp_path, plain):
    file = File(tmp_path)
    chosen = np.array([7, 3, 3, 39], "<u2")
    file.primitive["indices"] = file.add_accessor(chosen, 5123, "SCALAR")
    assert same(read(file.written()).gaussians, plain.rows(torch.from_numpy(chosen.astype(np.int64))))


def test_integers_that_are_normalised(tmp_path):
    """Opacities in bytes, rotations in shorts: as KHR_gaussian_splatting allows."""
    file = File(tmp_path)
    shorts = np.round(32767 * file.values(f"{SPLATS}:ROTATION")).astype("<i2")
    opacities = np.round(255 * GAUSSIANS.opacities.numpy()[:, None]).astype("u1")
    for name, values, component, kind in (
        ("ROTATION", shorts, 5122, "VEC4"),
        ("OPACITY", opacities, 5121, "SCALAR"),
    ):
        index = file.add_accessor(values, component, kind, normalized=True)
        file.primitive["attributes"][f"{SPLATS}:{name}"] = index
    found = read(file.written()).gaussians
    assert float((found.opacities - GAUSSIANS.opacities).abs().max()) <= 0.5 / 255 + 1e-6
    assert float((found.quats - GAUSSIANS.quats).abs().max()) <= 2 / 32767  # half a step each, then a norm


def test_numbers_that_are_not_finite_are_said_once(tmp_path):
    """Signalling NaN, infinity and what overflows: left out, and no warning of numpy's gets through."""
    file = File(tmp_path)
    values = file.values("POSITION")
    values.view("<u4")[0] = 0x7F800001
    values[1], values[2] = np.inf, 3e38
    start = file.json["bufferViews"][0]["byteOffset"]
    file.buffer = file.buffer[:start] + values.tobytes() + file.buffer[start + values.nbytes :]
    file.json["nodes"][0]["scale"] = [10, 10, 10]
    found = read(file.written())
    assert len(found.gaussians) == COUNT - 3
    assert any("3 of 40 Gaussians" in said for said in found.record.warnings)
    file.json["nodes"][0]["scale"] = [1e200] * 3
    with pytest.raises(SceneFileError):
        read(file.written())


@pytest.mark.parametrize("name", ["kernel", "projection", "colorSpace"])
def test_kinds_that_are_not_known_are_said(tmp_path, plain, name):
    """Their extension asks readers to fall back."""
    file = File(tmp_path)
    file.primitive["extensions"][SPLATS][name] = "acme_kind"
    found = read(file.written())
    assert same(found.gaussians, plain)
    assert any("acme_kind" in said for said in found.record.warnings)


def test_logarithms_of_scales(tmp_path, plain):
    """Drafts of the extension stored these: as lengths, all but nothing would be seen."""
    file = File(tmp_path)
    logs = np.log(file.values(f"{SPLATS}:SCALE"))
    file.primitive["attributes"][f"{SPLATS}:SCALE"] = file.add_accessor(logs.astype("<f4"), 5126, "VEC3")
    found = read(file.written())
    np.testing.assert_allclose(found.gaussians.scales, plain.scales, rtol=4e-6)  # log in float32 of up to 13
    assert any("logarithms" in said for said in found.record.warnings)
    logs[4:] = 0.5
    file.primitive["attributes"][f"{SPLATS}:SCALE"] = file.add_accessor(logs.astype("<f4"), 5126, "VEC3")
    with pytest.raises(SceneFileError, match="scales below 0"):
        read(file.written())


def test_language_of_one_of_several_is_left_out_and_said(tmp_path):
    file = File(tmp_path)
    file.primitive["extensions"]["LANGFLASH_language"] = {"bufferView": file.add_view(bytes(8))}
    file.json["nodes"].append({"mesh": 0, "translation": [1, 0, 0]})
    file.roots.append(1)
    found = read(file.written())
    assert len(found.gaussians) == 2 * COUNT
    assert any("without the language" in said for said in found.record.warnings)
