"""OpenUSD's ParticleField3DGaussianSplat: one prim with arrays, all values activated, through usd-core.

Axes of the file are right, up, back, said with it as upAxis Y; rotations are quaternions, scales lengths,
opacities in [0, 1]; harmonics have all bases of a Gaussian together. A unit is said to be as many metres as
the scene knows, else one. Stages in half precision, Z up,
and under transformed parents are read too.

Source: OpenUSD 26.03 and later, the schemas of usdVol (generatedSchema.usda).
"""

import tempfile
from pathlib import Path

import numpy as np

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.packing import check_some, placed, told, turned
from langflash_core.export.stored import ROWS_AT_ONCE, Gathering, Rows, parts, to_scene
from langflash_core.files import written_atomically
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.geometry.turning import axes_matrix
from langflash_core.types import Scene

_AXES = {"Y": "RUB", "Z": "RFU"}  # by a stage's upAxis
_KIND = "ParticleField3DGaussianSplat"
_ABSENT = "OpenUSD is not installed; pip install 'langflash[usd]'"
_REMEDY = "export it again, or name a .ply"


def read_usd(path: Path) -> Scene:
    """The Gaussians of a .usd, .usda, .usdc or .usdz, of all its prims together.

    Raises:
        SceneFileError: no OpenUSD, missing, damaged, or without a usable Gaussian.
    """
    pxr = _pxr()
    if pxr is None:
        raise SceneFileError(f"{path.name} cannot be read: {_ABSENT}")
    if not path.stat().st_size:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    try:
        stage = pxr.Usd.Stage.Open(str(path))
        prims = [prim for prim in stage.Traverse() if prim.GetTypeName() == _KIND]
        if not prims:
            raise SceneFileError(f"{path.name} holds no Gaussians (no {_KIND}); {_REMEDY}")
        axes = _AXES[str(pxr.UsdGeom.GetStageUpAxis(stage))]
        fields = [_fields(prim, pxr) for prim in prims]
        num_bases = max(rows.sh.shape[1] for rows in fields)
        gathering = Gathering(sum(len(rows.means) for rows in fields), num_bases)
        for rows, prim in zip(fields, prims, strict=True):
            place = np.array(pxr.UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
            for first in range(0, len(rows.means), ROWS_AT_ONCE):
                some = Rows(*(values[first : first + ROWS_AT_ONCE] for values in rows.all()))
                gathering.add(_padded(placed(some, place, axes), num_bases))
    except (RuntimeError, ValueError, TypeError, KeyError, pxr.Tf.ErrorException) as error:
        raise SceneFileError(f"{path.name} is damaged or no USD ({told(error)}); {_REMEDY}") from error
    return to_scene(gathering, path.name, [], logs=False, logits=False)


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
        _write_stage(scene, plain, pxr)
        if suffix == ".usdz":
            package = Path(folder) / "scene.usdz"
            if not pxr.UsdUtils.CreateNewUsdzPackage(pxr.Sdf.AssetPath(str(plain)), str(package)):
                raise OutputError(f"cannot write {path.name}: OpenUSD could not pack it; name a .usdc")
            plain = package
        target.write_bytes(plain.read_bytes())


def _pxr():
    """The modules of usd-core that are needed, None where it is absent or older than the schema."""
    try:
        from types import SimpleNamespace

        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdUtils, UsdVol, Vt
    except ImportError:
        return None
    if not hasattr(UsdVol, _KIND):
        return None
    return SimpleNamespace(
        Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdUtils=UsdUtils, UsdVol=UsdVol, Vt=Vt
    )


def _fields(prim, pxr) -> Rows:
    """A prim's arrays in its own axes.

    Raises:
        ValueError: their lengths disagree.
    """
    field = pxr.UsdVol.ParticleField3DGaussianSplat(prim)
    means = _array(prim, "positions", 3)
    count = len(means)
    quats = _array(prim, "orientations", 4)  # OpenUSD hands quaternions over as xyzw
    scales, opacities = _array(prim, "scales", 3), _array(prim, "opacities", 1)[:, 0]
    flat = _array(prim, "radiance:sphericalHarmonicsCoefficients", 3)
    degree = field.GetRadianceSphericalHarmonicsDegreeAttr().Get()
    bases = (degree + 1) ** 2 if degree is not None and 0 <= degree <= 10 else 0
    if not count or len(flat) != count * bases or {len(quats), len(scales), len(opacities)} != {count}:
        raise ValueError(f"{count:,} positions, and other numbers of the rest")
    sh = flat.reshape(count, bases, 3)[:, : (MAX_SHOWN_DEGREE + 1) ** 2]
    return Rows(means, quats[:, [3, 0, 1, 2]], scales, opacities, np.ascontiguousarray(sh))


def _array(prim, name: str, width: int) -> np.ndarray:
    """An attribute (n, width) float32, of whichever precision has values; (0, width) where none has."""
    for suffix in ("", "h"):
        values = prim.GetAttribute(name + suffix).Get()
        if values is not None and len(values):
            return np.asarray(values, np.float32).reshape(-1, width)
    return np.zeros((0, width), np.float32)


def _padded(rows: Rows, num_bases: int) -> Rows:
    missing = num_bases - rows.sh.shape[1]
    sh = np.pad(rows.sh, ((0, 0), (0, missing), (0, 0))) if missing else rows.sh
    return Rows(rows.means, rows.quats, rows.scales, rows.opacities, sh)


def _write_stage(scene: Scene, path: Path, pxr) -> None:
    num_bases = min(scene.gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    matrix = axes_matrix(_AXES["Y"])
    turned_parts = [turned(part, matrix) for part in parts(scene.gaussians)]
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
