"""OpenUSD's ParticleField3DGaussianSplat: one prim with arrays, all values activated, through usd-core.

Axes of the file are right, up, back, said with it as upAxis Y; rotations are quaternions, scales lengths,
opacities in [0, 1]; harmonics have all bases of a Gaussian together. A unit is said to be as many metres as
the scene knows, else one. Stages in half precision, Z up,
and under transformed parents are read too.

Colours are sRGB values, and said to be (UsdColorSpaceAPI), for what says nothing may be taken for linear.
Stages that name linear ones are converted; those that name none are taken for sRGB, as trainers leave them.

Source: OpenUSD 26.03 and later, the schemas of usdVol (generatedSchema.usda).
"""

import importlib.util
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from langflash_core.base.apart import Ended, Part, Refused, ask
from langflash_core.base.files import written_atomically
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.colours import Encoding, encoding_of, with_srgb_colours
from langflash_core.export.packing import check_some, error_line, place_rows, transform_rows
from langflash_core.export.settings import STORED
from langflash_core.export.stored import Gathering, Rows, parts, to_scene
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.geometry.turning import axes_matrix
from langflash_core.types import Scene

_AXES = {"Y": "RUB", "Z": "RFU"}  # by a stage's upAxis
# The attributes that `langflash_core/base/apart/stages.py` reads, which imports OpenUSD.
ARRAYS = ("positions", "orientations", "scales", "opacities")
HARMONICS = "radiance:sphericalHarmonicsCoefficients"
_SPACE = "srgb_rec709_scene"  # OpenUSD's own name of sRGB; it knows none of a display
_KIND = "ParticleField3DGaussianSplat"
_ABSENT = "OpenUSD is not installed; pip install 'langflash[usd]'"
_REMEDY = "export it again, or name a .ply"


def read_usd(path: Path) -> Scene:
    """The Gaussians of a .usd, .usda, .usdc or .usdz, of all its prims together; OpenUSD reads it in a
    process of its own.

    Raises:
        SceneFileError: no OpenUSD, missing, damaged, without a usable Gaussian, or too much for OpenUSD.
    """
    if not is_installed():
        raise SceneFileError(f"{path.name} cannot be read: {_ABSENT}")
    if not path.stat().st_size:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    try:
        prims = [_prim(part, path.name) for part in ask("stage", {"path": str(path.absolute())})]
        if not prims:
            raise SceneFileError(f"{path.name} holds no Gaussians (no {_KIND}); {_REMEDY}")
        gathering = _gather_prims(prims, path.name)
    except Ended as error:
        raise SceneFileError(f"{path.name} cannot be read: OpenUSD {error}; {_REMEDY}") from error
    except (Refused, ValueError, TypeError, KeyError) as error:
        raise SceneFileError(f"{path.name} is damaged or no USD ({error_line(error)}); {_REMEDY}") from error
    said = dict.fromkeys(encoding.said for *_, encoding in prims if encoding.said)
    return to_scene(gathering, path.name, list(said), logs=False, logits=False)


def write_usd(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, in its own order; the suffix says whether as text, binary or package.

    Raises:
        OutputError: no OpenUSD, nothing to write, or an unwritable path.
    """
    check_some(scene.gaussians, path)
    pxr = _pxr()
    if pxr is None:
        raise OutputError(f"cannot write {path.name}: {_ABSENT}")
    with tempfile.TemporaryDirectory() as folder, written_atomically(path) as target:
        suffix = path.suffix.lower()
        plain = Path(folder) / f"scene{'.usdc' if suffix == '.usdz' else suffix}"
        try:
            _write_stage(scene, plain, pxr)
            if suffix == ".usdz":
                package = Path(folder) / "scene.usdz"
                if not pxr.UsdUtils.CreateNewUsdzPackage(pxr.Sdf.AssetPath(str(plain)), str(package)):
                    raise OutputError(f"cannot write {path.name}: OpenUSD could not pack it; name a .usdc")
                plain = package
        except pxr.Tf.ErrorException as error:
            why = f"OpenUSD says '{_reason(error)}'; make room, also in {tempfile.gettempdir()}"
            raise OutputError(f"cannot write {path.name}: {why}") from error
        target.write_bytes(plain.read_bytes())


def _reason(error: Exception) -> str:
    """What OpenUSD says first: it stands in quotation marks behind the place in its source."""
    first = str(error).strip().partition("\n")[0]
    return first.partition(" : '")[2].removesuffix("'") or first


def is_installed() -> bool:
    """Whether there is an OpenUSD; without importing it."""
    return importlib.util.find_spec("pxr") is not None


def _pxr():
    """The modules of usd-core that are needed, None where it is absent or older than the schema."""
    try:
        from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils, UsdVol, Vt
    except ImportError:
        return None
    modules = {"Sdf": Sdf, "Tf": Tf, "Usd": Usd, "UsdGeom": UsdGeom, "UsdUtils": UsdUtils}
    return SimpleNamespace(**modules, UsdVol=UsdVol, Vt=Vt) if hasattr(UsdVol, _KIND) else None


_Prim = tuple[Rows, np.ndarray, str, Encoding]


def _prim(part: Part, name: str) -> _Prim:
    """A prim's arrays in its own axes, its place (4, 4), the stage's axes, and how colours are encoded."""
    means, quats, scales, opacities, flat = (part.arrays[name] for name in (*ARRAYS, HARMONICS))
    count, degree = len(means), part.facts["degree"]
    bases = (degree + 1) ** 2 if degree is not None and 0 <= degree <= 10 else 0
    if not count or len(flat) != count * bases or {len(quats), len(scales), len(opacities)} != {count}:
        raise ValueError(f"{count:,} positions, and other numbers of the rest")
    sh = flat.reshape(count, bases, 3)[:, : (MAX_SHOWN_DEGREE + 1) ** 2]
    # OpenUSD hands quaternions over as xyzw.
    rows = Rows(means, quats[:, [3, 0, 1, 2]], scales, opacities[:, 0], np.ascontiguousarray(sh))
    place = np.array(part.facts["place"], np.float64).reshape(4, 4)
    return rows, place, _AXES[part.facts["up"]], encoding_of(str(part.facts["space"]), name)


@np.errstate(all="ignore")  # numbers that are not finite are left out, and said
def _gather_prims(prims: list[_Prim], name: str) -> Gathering:
    num_bases = max(rows.sh.shape[1] for rows, *_ in prims)
    gathering = Gathering(sum(len(rows.means) for rows, *_ in prims), num_bases, name)
    for rows, place, axes, encoding in prims:
        for first in range(0, len(rows.means), STORED.rows_at_once):
            some = rows.some(slice(first, first + STORED.rows_at_once))
            some = with_srgb_colours(some) if encoding.linear else some
            placed = place_rows(some, place, axes)
            missing = num_bases - placed.sh.shape[1]
            gathering.add(replace(placed, sh=np.pad(placed.sh, ((0, 0), (0, missing), (0, 0)))))
    return gathering


def _write_stage(scene: Scene, path: Path, pxr) -> None:
    num_bases = min(scene.gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    matrix = axes_matrix(_AXES["Y"])
    turned_parts = [transform_rows(part, matrix) for part in parts(scene.gaussians)]
    means, quats, scales, opacities, sh = (
        np.ascontiguousarray(np.concatenate(values))
        for values in zip(*(part.all() for part in turned_parts), strict=True)
    )
    stage = pxr.Usd.Stage.CreateNew(str(path))
    pxr.UsdGeom.SetStageUpAxis(stage, pxr.UsdGeom.Tokens.y)
    # Unsaid, a unit is a centimetre to OpenUSD.
    pxr.UsdGeom.SetStageMetersPerUnit(stage, scene.record.metric_scale or 1.0)
    field = pxr.UsdVol.ParticleField3DGaussianSplat.Define(stage, "/Splats")
    stage.SetDefaultPrim(field.GetPrim())
    pxr.Usd.ColorSpaceAPI.Apply(field.GetPrim()).CreateColorSpaceNameAttr(_SPACE)
    arrays = pxr.Vt
    field.GetPositionsAttr().Set(arrays.Vec3fArray.FromNumpy(means))
    field.GetOrientationsAttr().Set(arrays.QuatfArray.FromNumpy(np.ascontiguousarray(quats[:, [1, 2, 3, 0]])))
    field.GetScalesAttr().Set(arrays.Vec3fArray.FromNumpy(scales))
    field.GetOpacitiesAttr().Set(arrays.FloatArray.FromNumpy(opacities))
    field.GetRadianceSphericalHarmonicsDegreeAttr().Set(int(num_bases**0.5) - 1)
    flat = np.ascontiguousarray(sh[:, :num_bases].reshape(-1, 3))
    field.GetRadianceSphericalHarmonicsCoefficientsAttr().Set(arrays.Vec3fArray.FromNumpy(flat))
    reach = 3 * scales.max(1, keepdims=True)
    corners = np.stack(((means - reach).min(0), (means + reach).max(0)))
    field.GetPrim().GetAttribute("extent").Set(arrays.Vec3fArray.FromNumpy(np.ascontiguousarray(corners)))
    stage.Save()
