"""Our splat files read by other programs, and theirs by us: a script, as those are not installed everywhere.

    python -m tests.export.cross_check SCENE [--splat-transform PATH] [--only KIND ...]

SCENE is a .splat, .ply or whatever we read. Readers: @playcanvas/splat-transform 3.x (npm, its
bin/cli.mjs through node), and the Python packages gaussforge and gsply where they are importable.
Each file of ours is turned into a plain .ply by the other program and compared with what we read from the
same file; each file that it writes is read by us and by it. Numbers are differences of the whole scene, in
the order of the file: positions and colours as they are, shapes as covariances (N, 3, 3) relative to the
largest, opacities. Prints a table; the exit status is 1 where one differs by more than rounding.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from langflash_core.errors import LangFlashError
from langflash_core.export import export, read
from langflash_core.export.packing import turned
from langflash_core.export.stored import Rows
from langflash_core.geometry.turning import axes_matrix
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Gaussians, Scene
from tests.geometry.spread import covariances

_Convert = Callable[[Path, Path], None]
# Axes that a reader leaves a format's numbers in, where it does not turn them to right, down, forward.
_LEFT = {("splat-transform", ".spz"): "RUB", ("gaussforge", ".spz"): "RUB", ("gsply", ".spz"): "RUB"}
# splat-transform takes bytes of a .splat's rotation for 2 b / 255 - 1, the format's own code for b / 128 - 1.
_LOOSE = {".splat": {"shapes": 0.05}}
_MISSING = (ImportError, AttributeError)  # a package that another needs for a format, or a version's names
_LIMITS = {"means": 1e-5, "shapes": 2e-3, "opacities": 3e-3, "colours": 1e-4, "rest": 1e-4}


def say(text: str) -> None:
    sys.stdout.write(text + "\n")


def differences(ours: Gaussians, theirs: Gaussians) -> dict[str, float]:
    """Largest differences; positions relative to the scene's extent."""
    if len(ours) != len(theirs):
        return {"count": float(len(theirs) - len(ours))}
    extent = float((ours.means.amax(0) - ours.means.amin(0)).max()) or 1.0
    shapes = covariances(ours.quats, ours.scales), covariances(theirs.quats, theirs.scales)
    largest = shapes[0].abs().amax((1, 2), keepdim=True).clamp_min(1e-30)
    shown = min(ours.sh.shape[1], theirs.sh.shape[1])
    found = {
        "means": float((ours.means - theirs.means).abs().max()) / extent,
        "shapes": float(((shapes[0] - shapes[1]) / largest).abs().max()),
        "opacities": float((ours.opacities - theirs.opacities).abs().max()),
        "colours": float((ours.sh[:, 0] - theirs.sh[:, 0]).abs().max()),
    }
    return found | (
        {"rest": float((ours.sh[:, 1:shown] - theirs.sh[:, 1:shown]).abs().max())} if shown > 1 else {}
    )


def in_our_axes(gaussians: Gaussians, axes: str) -> Gaussians:
    values = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    rows = turned(Rows(*(v.numpy() for v in values)), axes_matrix(axes).T)
    return Gaussians(*(torch.from_numpy(v) for v in rows.all()))


def splat_transform(program: Path) -> _Convert:
    def convert(source: Path, target: Path) -> None:
        words = ["node", str(program), "-q", "-w", "-g", "cpu", str(source), str(target)]
        subprocess.run(words, check=True, capture_output=True, timeout=1200)

    return convert


def gaussforge(source: Path, target: Path) -> None:
    import gaussforge  # pyright: ignore[reportMissingImports]

    kinds = {".compressed.ply": "compressed.ply"}
    source_kind = next((k for e, k in kinds.items() if source.name.endswith(e)), source.suffix[1:])
    target_kind = next((k for e, k in kinds.items() if target.name.endswith(e)), target.suffix[1:])
    result = gaussforge.GaussForge().convert(source.read_bytes(), source_kind, target_kind)
    if "error" in result:
        raise RuntimeError(result["error"])
    target.write_bytes(result["data"])


def gsply(source: Path, target: Path) -> None:
    import gsply as package  # pyright: ignore[reportMissingImports]

    readers = {".spz": "read_spz", ".sog": "sogread"}
    read_file = getattr(package, readers.get(source.suffix, "plyread"))
    package.plywrite(str(target), read_file(str(source)))


def programs(path: Path | None) -> dict[str, tuple[_Convert, tuple[str, ...], tuple[str, ...]]]:
    """By name: how it converts, what it reads and what it writes."""
    found = {}
    if path is not None:
        both = (".splat", ".spz", ".sog", ".compressed.ply")
        found["splat-transform"] = (splat_transform(path), ("meta.json", *both), (".glb", *both[1:]))
    for name, call, reads, writes in (
        (
            "gaussforge",
            gaussforge,
            (".splat", ".spz", ".sog", ".compressed.ply"),
            (".ksplat", ".spz", ".compressed.ply"),
        ),
        ("gsply", gsply, (".spz", ".sog", ".compressed.ply"), ()),
    ):
        try:
            __import__(name)
        except ImportError:
            continue
        found[name] = (call, reads, writes)
    return found


def check(name: str, kind: str, ours: Gaussians, theirs: Callable[[], Gaussians]) -> bool:
    """Print a row; whether all is within rounding."""
    try:
        found = differences(ours, theirs())
    except (LangFlashError, subprocess.SubprocessError, *_MISSING, RuntimeError, OSError) as error:
        say(f"{name:44} {kind:16} failed: {str(error)[:150]}")
        return False
    limits = _LIMITS | _LOOSE.get(kind, {})
    fine = all(value <= limits.get(key, 0) for key, value in found.items())
    told = " ".join(f"{key} {value:.1e}" for key, value in found.items())
    say(f"{name:44} {kind:16} {told}{'' if fine else '  DIFFERS'}")
    return fine


def compare_all(scene: Scene, folder: Path, known: dict, only: list[str]) -> bool:
    export(scene, folder / "plain.ply")
    fine = True
    for name, (convert, reads, writes) in known.items():
        for kind in (k for k in reads if k in only or not only):
            path = folder / (kind if kind == "meta.json" else f"ours{kind}")
            export(scene, path)

            def read_by_them(path=path, kind=kind, convert=convert, name=name) -> Gaussians:
                convert(path, folder / "theirs.ply")
                gaussians = read(folder / "theirs.ply").gaussians
                axes = _LEFT.get((name, kind))
                return in_our_axes(gaussians, axes) if axes else gaussians

            fine &= check(f"ours, read by {name}", kind, read(path).gaussians, read_by_them)
        for kind in (k for k in writes if k in only or not only):
            path = folder / f"by_them{kind}"
            # gaussforge orders the harmonics of a .ksplat as no other program does.
            reader = "splat-transform" if kind == ".ksplat" and "splat-transform" in known else name
            fine &= written_by((name, reader), kind, path, (convert, known[reader][0]), folder)
    return fine


def written_by(
    names: tuple[str, str], kind: str, path: Path, converts: tuple[_Convert, _Convert], folder: Path
) -> bool:
    """A file that one writes: we read it as the other does, or, where none does, as what it was made from."""
    name, reader = names
    try:
        converts[0](folder / "plain.ply", path)
        ours = read(path).gaussians
    except (LangFlashError, subprocess.SubprocessError, RuntimeError, OSError) as error:
        say(f"{name + ', read by us':44} {kind:16} failed: {str(error)[:150]}")
        return False

    def theirs() -> Gaussians:
        if kind == ".glb":
            return read(folder / "plain.ply").gaussians
        converts[1](path, folder / "again.ply")
        gaussians = read(folder / "again.ply").gaussians
        axes = _LEFT.get((reader, kind))
        return in_our_axes(gaussians, axes) if axes else gaussians

    return check(f"{name}'s, read by us and {reader}", kind, ours, theirs)


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--splat-transform", type=Path, help="its bin/cli.mjs")
    parser.add_argument("--only", nargs="*", default=[], help="kinds, such as .spz")
    parser.add_argument("--most", type=int, help="Gaussians, evenly chosen")
    args = parser.parse_args()
    scene = read(args.scene)
    if args.most and len(scene.gaussians) > args.most:
        step = -(-len(scene.gaussians) // args.most)
        scene = bare_scene(scene.gaussians.map(lambda v: v[::step]), args.scene.name)
    np.seterr(all="ignore")
    known = programs(args.splat_transform)
    say(f"{len(scene.gaussians):,} Gaussians of {scene.gaussians.sh.shape[1]} bases; {', '.join(known)}")
    with tempfile.TemporaryDirectory() as folder:
        return 0 if known and compare_all(scene, Path(folder), known, args.only) else 1


if __name__ == "__main__":
    sys.exit(main())
