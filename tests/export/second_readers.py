"""Our .glb and .usd read by other programs: a script, as those are not installed everywhere.

    python -m tests.export.second_readers SCENE [--node-modules DIR]

splat-transform, of `cross_check`, reads neither. Here a .glb is judged by Khronos' gltf-validator and its
numbers read by @gltf-transform/core (npm, DIR holds both); a .usda, .usdc and .usdz by the schema classes
of usd-core and its validators, where they are importable. All numbers are compared with those of
the scene, turned into the file's axes by hand. The exit status is 1 where one differs or is refused.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np

from langflash_core.export import export, read
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.types import Scene

_READ_GLB = """
const { NodeIO } = require('@gltf-transform/core');
const { validateBytes } = require('gltf-validator');
const fs = require('fs');
(async () => {
  const bytes = new Uint8Array(fs.readFileSync(process.argv[1]));
  const report = await validateBytes(bytes, { maxIssues: 20 });
  const document = await new NodeIO().readBinary(bytes);
  const primitive = document.getRoot().listMeshes()[0].listPrimitives()[0];
  const arrays = {};
  for (const name of primitive.listSemantics())
    arrays[name] = Array.from(primitive.getAttribute(name).getArray());
  process.stdout.write(JSON.stringify({ issues: report.issues, arrays }));
})().catch((error) => { console.error(error); process.exit(1); });
"""
_LUF, _RUB = np.diag([-1.0, -1.0, 1.0]), np.diag([1.0, -1.0, -1.0])  # from right, down, forward; half turns
_PREFIX = "KHR_gaussian_splatting:"
_ROUNDING = 2e-6  # of float32, relative to the largest number


def say(text: str) -> None:
    sys.stdout.write(text + "\n")


def differs(name: str, found: np.ndarray, expected: np.ndarray) -> bool:
    """Print a row; whether a number is another."""
    if found.shape != expected.shape:
        say(f"  {name:22} {found.shape} instead of {expected.shape}  DIFFERS")
        return True
    error = float(np.abs(found - expected).max()) / max(1.0, float(np.abs(expected).max()))
    say(f"  {name:22} {error:.1e}{'' if error <= _ROUNDING else '  DIFFERS'}")
    return error > _ROUNDING


def compared(scene: Scene, matrix: np.ndarray, found: dict[str, np.ndarray]) -> bool:
    """Whether means, rotations (N, 4 wxyz), scales, opacities and constant colours are the scene's.

    Args:
        matrix: from our axes to the file's.
    """
    ours = scene.gaussians.map(lambda values: values.double())
    turns = matrix @ quats_to_matrices(ours.quats).numpy()
    rotations = quats_to_matrices(scene.gaussians.means.new_tensor(found["rotations"]).double()).numpy()
    # A file may hold R or R with axes mirrored in pairs: the ellipsoid decides.
    spread = ours.scales.numpy()[:, None, :] ** 2
    rows = [
        differs("means", found["means"], ours.means.numpy() @ matrix.T),
        differs("scales", found["scales"], ours.scales.numpy()),
        differs("covariances", _spread(rotations, spread), _spread(turns, spread)),
        differs("opacities", found["opacities"], ours.opacities.numpy()),
        differs("colours", found["colours"], 0.5 + SH_C0 * ours.sh[:, 0].numpy()),
    ]
    return not any(rows)


def _spread(turns: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Covariances relative to the largest variance of each."""
    return ((turns * squares) @ turns.swapaxes(1, 2)) / squares.max(-1, keepdims=True)


def check_glb(scene: Scene, path: Path, modules: Path) -> bool:
    done = subprocess.run(
        ["node", "-e", _READ_GLB, str(path)], capture_output=True, text=True, cwd=modules.parent, timeout=600
    )
    if done.returncode:
        say(f".glb: {done.stderr[-400:]}")
        return False
    report = json.loads(done.stdout)
    # The validator does not know the extension yet, and calls its attributes invalid names.
    errors = [each for each in report["issues"]["messages"] if each["severity"] == 0]
    issues = [f"{each['code']} {each['pointer']}" for each in errors]
    refused = [each for each in issues if not ("INVALID_ATTRIBUTE" in each and _PREFIX in each)]
    say(f".glb: gltf-validator knows {len(issues) - len(refused)} attributes not, and refuses {refused}")
    arrays = {name: np.array(values) for name, values in report["arrays"].items()}
    quats = arrays[f"{_PREFIX}ROTATION"].reshape(-1, 4)[:, [3, 0, 1, 2]]
    found = {
        "means": arrays["POSITION"].reshape(-1, 3),
        "rotations": quats,
        "scales": arrays[f"{_PREFIX}SCALE"].reshape(-1, 3),
        "opacities": arrays[f"{_PREFIX}OPACITY"],
        "colours": 0.5 + SH_C0 * arrays[f"{_PREFIX}SH_DEGREE_0_COEF_0"].reshape(-1, 3),
    }
    return compared(scene, _LUF, found) and not refused


def check_usd(scene: Scene, path: Path) -> bool:
    Usd, UsdGeom, UsdValidation, UsdVol = (
        import_module(f"pxr.{part}") for part in ("Usd", "UsdGeom", "UsdValidation", "UsdVol")
    )

    stage = Usd.Stage.Open(str(path))
    (prim,) = [each for each in stage.Traverse() if each.IsA(UsdVol.ParticleField3DGaussianSplat)]
    schema = UsdVol.ParticleField3DGaussianSplat(prim)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    refused = [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)]
    axis = UsdGeom.GetStageUpAxis(stage)
    say(f"{path.suffix}: {len(validators)} validators refuse {refused}; upAxis {axis}")
    quats = np.array([(q.GetReal(), *q.GetImaginary()) for q in schema.GetOrientationsAttr().Get()])
    degree = int(schema.GetRadianceSphericalHarmonicsDegreeAttr().Get())
    harmonics = np.array(schema.GetRadianceSphericalHarmonicsCoefficientsAttr().Get())
    found = {
        "means": np.array(schema.GetPositionsAttr().Get()),
        "rotations": quats,
        "scales": np.array(schema.GetScalesAttr().Get()),
        "opacities": np.array(schema.GetOpacitiesAttr().Get()),
        "colours": 0.5 + SH_C0 * harmonics.reshape(len(quats), (degree + 1) ** 2, 3)[:, 0],
    }
    return compared(scene, _RUB, found) and not refused


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--node-modules", type=Path, help="with gltf-validator and @gltf-transform/core")
    args = parser.parse_args()
    scene, results = read(args.scene), []
    with tempfile.TemporaryDirectory() as folder:
        if args.node_modules is not None:
            export(scene, Path(folder) / "a.glb")
            results.append(check_glb(scene, Path(folder) / "a.glb", args.node_modules.resolve()))
        try:
            import pxr  # noqa: F401
        except ImportError:
            say("usd-core is not installed")
        else:
            for suffix in (".usda", ".usdc", ".usdz"):
                path = Path(folder) / f"a{suffix}"
                export(scene, path)
                results.append(check_usd(scene, path))
    return 0 if results and all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
