"""OpenUSD's ParticleField3DGaussianSplat: the arrays of every prim of a stage, as OpenUSD reads them."""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdVol  # type: ignore[attr-defined]

KIND = "ParticleField3DGaussianSplat"
ARRAYS = {"positions": 3, "orientations": 4, "scales": 3, "opacities": 1}
HARMONICS = "radiance:sphericalHarmonicsCoefficients"


def answers(reader: str, request: dict[str, Any], content: bytes) -> Iterator[tuple[dict, dict]]:
    """A part a prim, in the stage's order: facts degree (None: unsaid), up (the stage's axis), space (of
    colours; "" is unsaid) and place (4 x 4, local to world, columns first); arrays of `ARRAYS` (n, width) and
    `HARMONICS` (n bases, 3), float32, orientations xyzw.

    Args:
        request: "path".

    Raises:
        RuntimeError, ValueError: it is damaged, no stage, or too large.
    """
    if not hasattr(UsdVol, KIND):
        raise ValueError("this OpenUSD is older than 26.3 and knows no Gaussians")
    stage = Usd.Stage.Open(request["path"])
    up = str(UsdGeom.GetStageUpAxis(stage))
    for prim in stage.Traverse():
        if prim.GetTypeName() != KIND:
            continue
        arrays = {name: _array(prim, name, width) for name, width in (*ARRAYS.items(), (HARMONICS, 3))}
        degree = UsdVol.ParticleField3DGaussianSplat(prim).GetRadianceSphericalHarmonicsDegreeAttr().Get()
        place = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
        space = _colour_space(prim)
        yield {"degree": degree, "up": up, "space": space, "place": place.tolist()}, arrays


def _colour_space(prim: Usd.Prim) -> str:
    """Of a prim's harmonics: what they say themselves, else the nearest of the prim and those above it."""
    for suffix in ("", "h"):
        own = prim.GetAttribute(HARMONICS + suffix).GetColorSpace()
        if own:
            return str(own)
    while prim:
        said = prim.GetAttribute("colorSpace:name")  # of UsdColorSpaceAPI
        if said and said.Get():
            return str(said.Get())
        prim = prim.GetParent()
    return ""


def _array(prim: Usd.Prim, name: str, width: int) -> np.ndarray:
    """An attribute (n, width) float32, of whichever precision has values; (0, width) where none has."""
    for suffix in ("", "h"):
        values = prim.GetAttribute(name + suffix).Get()
        if values is not None and len(values):
            return np.ascontiguousarray(np.asarray(values, np.float32).reshape(-1, width))
    return np.zeros((0, width), np.float32)
