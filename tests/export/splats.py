"""Small random splats, and a PLY writer of the tests' own that can also write what is wrong."""

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.errors import SceneFileError
from langflash_core.types import Gaussians

NAMES = (
    *("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)


def random_gaussians(count: int, degree: int = 0, seed: int = 0) -> Gaussians:
    """Opacities from 0 to 1, both included; scales over six decades."""
    rng = torch.Generator().manual_seed(seed)

    def draw(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=rng)

    opacities = torch.sigmoid(3 * draw(count))
    opacities[: min(count, 2)] = torch.tensor([0.0, 1.0])[: min(count, 2)]
    return Gaussians(
        means=draw(count, 3),
        quats=normalize(draw(count, 4), dim=-1),
        scales=torch.exp(2 * draw(count, 3) - 5),
        opacities=opacities,
        sh=draw(count, (degree + 1) ** 2, 3),
    )


def same(one: Gaussians, other: Gaussians) -> bool:
    """To the last bit."""
    return all(torch.equal(values, getattr(other, name)) for name, values in vars(one).items())


def refusal(read: Callable[[], object]) -> str:
    """The one sentence by which a file is refused."""
    with pytest.raises(SceneFileError) as caught:
        read()
    sentence = str(caught.value)
    assert "; " in sentence and "\n" not in sentence, sentence
    return sentence


def stored_columns(count: int = 50, seed: int = 0) -> dict[str, np.ndarray]:
    """The required properties as a 3DGS trainer stores them, float32."""
    rng = np.random.default_rng(seed)
    columns = {name: rng.normal(size=count).astype(np.float32) for name in NAMES}
    for axis in range(3):
        columns[f"scale_{axis}"] -= 5
    columns["opacity"] *= 4
    return columns


def ply_bytes(
    columns: dict[str, np.ndarray],
    order: str = "<",
    count: int | None = None,
    before: bytes = b"",
    after: bytes = b"",
    header: str = "",
) -> bytes:
    """A PLY of one element `vertex`; types are the columns' own.

    order: "<" or ">". count: what the header claims. before, after: raw bytes around the rows, of
    the elements that `header` may declare (its lines with "BEFORE" come first).
    """
    kinds = {"f2": "half", "f4": "float", "f8": "double"}
    kinds |= {"u1": "uchar", "i1": "char", "u2": "ushort", "i2": "short", "i4": "int"}
    rows = np.empty(
        len(next(iter(columns.values()))), [(n, order + v.dtype.str[1:]) for n, v in columns.items()]
    )
    for name, values in columns.items():
        rows[name] = values
    early = [line.removeprefix("BEFORE ") for line in header.splitlines() if line.startswith("BEFORE ")]
    late = [line for line in header.splitlines() if not line.startswith("BEFORE ")]
    lines = [
        "ply",
        f"format binary_{'little' if order == '<' else 'big'}_endian 1.0",
        *early,
        f"element vertex {len(rows) if count is None else count}",
        *(f"property {kinds[v.dtype.str[1:]]} {n}" for n, v in columns.items()),
        *late,
        "end_header",
    ]
    return "\n".join(lines).encode() + b"\n" + before + rows.tobytes() + after


def glb_parts(path: Path) -> tuple[dict, bytes]:
    """The JSON and the buffer of a .glb."""
    content = path.read_bytes()
    size = struct.unpack_from("<I", content, 12)[0]
    return json.loads(content[20 : 20 + size]), content[28 + size :]


def glb_column(path: Path, accessor: int, kind: str, width: int) -> np.ndarray:
    """Rows of an accessor of a .glb."""
    document, buffer = glb_parts(path)
    described = document["accessors"][accessor]
    start = document["bufferViews"][described["bufferView"]]["byteOffset"]
    return np.frombuffer(buffer, kind, described["count"] * width, start).reshape(-1, width)


def damaged_files() -> dict[str, tuple[bytes, str]]:
    """Files named .ply that must be refused, and a word of the sentence that says why."""
    columns = stored_columns()
    good = ply_bytes(columns)
    body = good.index(b"end_header\n") + 11
    nothing = {name: values[:0] for name, values in columns.items()}
    unknown = {name: np.full_like(values, np.nan) for name, values in columns.items()}
    incomplete = {name: values for name, values in columns.items() if name != "rot_3"}
    points = {name: columns[name] for name in ("x", "y", "z")}
    listed = good.replace(b"property float opacity", b"property list uchar float opacity")
    return {
        "cut off in the rows": (good[:-100], "cut off"),
        "cut off in the header": (good[: body // 2], "cut off inside its header"),
        "more rows than said": (ply_bytes(columns, count=49), "damaged"),
        "fewer rows than said": (ply_bytes(columns, count=51), "cut off"),
        "an absurd count": (ply_bytes(columns, count=10**15), "cut off"),
        # `int` has a limit of its own, and another error.
        "a count of thousands of digits": (
            good.replace(b"vertex 50", b"vertex " + b"9" * 5000),
            "header line",
        ),
        "a negative count": (good.replace(b"vertex 50", b"vertex -5"), "header line"),
        "ascii": (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "ascii"),
        "a missing property": (ply_bytes(incomplete), "rot_3"),
        "a point cloud": (ply_bytes(points), "point cloud"),
        "only NaN": (ply_bytes(unknown), "not finite"),
        "no splats": (ply_bytes(nothing), "no Gaussians"),
        "no points": (b"ply\nformat binary_little_endian 1.0\nend_header\n", "no points"),
        "a JPEG": (b"\xff\xd8\xff\xe0" + bytes(500), "not a PLY"),
        "a shopping list": (b"milk\neggs\nplywood\n" * 30, "not a PLY"),
        "nothing at all": (b"", "empty"),
        "an endless header": (b"ply\n" + b"comment x\n" * 100_000, "does not end"),
        "a list": (listed, "list"),
        "an odd number of f_rest": (ply_bytes({**columns, "f_rest_0": columns["x"]}), "f_rest"),
        "a gap in f_rest": (
            ply_bytes({**columns, **{f"f_rest_{i}": columns["x"] for i in range(1, 10)}}),
            "f_rest",
        ),
        "an unknown type": (good.replace(b"float x", b"quad x"), "header line"),
        "a property twice": (good.replace(b"float y", b"float x"), "no y"),
        "no format": (good.replace(b"format binary_little_endian 1.0\n", b""), "no format"),
        "compressed": (
            ply_bytes({"packed_position": columns["x"], **points}),
            "uncompressed",
        ),
    }


def ksplat_bytes(gaussians: Gaussians, level: int) -> bytes:
    """A .ksplat of one section: full buckets of 256 and partial ones, after GaussianSplats3D's layout."""
    means, sh = gaussians.means.numpy(), gaussians.sh.numpy()
    count, degree = len(means), int(sh.shape[1] ** 0.5) - 1
    # Buckets that the section's order gives; each as wide as the whole scene, so all positions fit.
    side, capacity, steps = 5.0 * 4, 256, 32767
    full, sizes = count // capacity, [100, count % capacity - 100]
    buckets = np.split(np.arange(count), [capacity * (i + 1) for i in range(full)] + [capacity * full + 100])
    centres = np.stack([means[bucket].mean(0) for bucket in buckets]).astype("<f4")
    own = np.concatenate([np.full(len(bucket), index) for index, bucket in enumerate(buckets)])
    number = ("<f4", "<f2", "<f2")[level]
    rest = np.concatenate(
        [
            sh[:, each**2 : (each + 1) ** 2].transpose(0, 2, 1).reshape(count, -1)
            for each in range(1, degree + 1)
        ]
        or [np.zeros((count, 0), np.float32)],
        1,
    )
    if level == 2:
        rest = np.round((rest.clip(-1.5, 1.5) + 1.5) / 3 * 255).astype("u1")
    places = means.astype("<f4")
    if level:
        places = np.round((means - centres[own]) / (side / 2) * steps + steps).clip(0, 65535).astype("<u2")
    colours = np.concatenate((0.5 + 0.28209479177387814 * sh[:, 0], gaussians.opacities.numpy()[:, None]), 1)
    columns = (
        places,
        gaussians.scales.numpy().astype(number),
        gaussians.quats.numpy().astype(number),
        np.round(colours.clip(0, 1) * 255).astype("u1"),
        rest if level == 2 else rest.astype(number),
    )
    rows = [np.ascontiguousarray(column).view("u1").reshape(count, -1) for column in columns]
    body = np.array(sizes, "<u4").tobytes() + centres.tobytes() if level else b""
    body += np.concatenate(rows, 1).tobytes()
    main = struct.pack("<BBxxIIIIH14xff", 0, 1, 1, 1, count, count, level, 0, 0)
    section = struct.pack(
        "<IIIIfHxxI4xIIH", count, count, capacity, len(buckets) if level else 0, side,
        12 if level else 0, 0, full if level else 0, len(sizes) if level else 0, degree,
    )  # fmt: skip
    return main.ljust(4096, b"\0") + section.ljust(1024, b"\0") + body
