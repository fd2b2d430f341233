"""The steps of `card` that no command of LangFlash measures; each returns plain JSON values."""

import ctypes
import fcntl
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import torch

from app.bench import cases
from app.bench.generated import phrases
from app.bench.machine import host
from app.bench.measure import _Bench, _times
from app.bench.modes import DEFAULT, MODES
from langflash_core.base.graphics import COMPUTE, offscreen_context
from langflash_core.language.relevance import relevance_maps
from langflash_core.splat import NEAR, rasterize, view_colours
from langflash_core.types import Camera, Gaussians

_LOCK = Path(tempfile.gettempdir()) / "langflash-gsplat.lock"
_SMALL = (2048, 16, ((96, 64),), 2)  # Gaussians, atoms, sizes, frames of a rehearsal
_FRAMES = 50


def machine() -> tuple[dict, bool]:
    """What it is measured on, and whether there is a CUDA card."""
    card = torch.cuda.is_available()
    found = {**host(), "card": torch.cuda.get_device_name() if card else "none", "cuda": torch.version.cuda}
    if card:
        asked = ("nvidia-smi", "--query-gpu=driver_version,memory.total", "--format=csv,noheader")
        found["driver"] = subprocess.run(asked, capture_output=True, text=True).stdout.strip()
    return found, card


def milliseconds(work: Callable[[], object], repeats: int) -> float:
    """Median on the clock, with the card's queue empty before and after; three unmeasured before."""
    taken = []
    for number in range(repeats + 3):
        _settle()
        start = time.perf_counter()
        work()
        _settle()
        if number >= 3:
            taken.append(1e3 * (time.perf_counter() - start))
    return statistics.median(taken)


def _settle() -> None:
    if torch.cuda.is_available():
        torch.cuda.synchronize()


def ceilings(folder: Path, quick: bool) -> dict:
    """What the card can do at most: copying within it, and a bfloat16 product of 8192 a side."""
    side = 1024 if quick else 8192
    source = torch.empty(side * side * 16, device="cuda", dtype=torch.float32).normal_()
    target = torch.empty_like(source)
    a, b = (torch.randn(side, side, device="cuda", dtype=torch.bfloat16) for _ in range(2))
    copied = milliseconds(lambda: target.copy_(source), 10)
    product = milliseconds(lambda: a @ b, 10)
    return {
        "copy_gb_s_read_and_written": 2 * source.nbytes / copied / 1e6,
        "bf16_tflop_s": 2 * side**3 / product / 1e9,
    }


def _plan(quick: bool) -> tuple[int, int, tuple[tuple[int, int], ...], int]:
    return _SMALL if quick else (cases.PAPER_GAUSSIANS, cases.PAPER_ATOMS, cases.PAPER_SIZES, _FRAMES)


def _context():
    """An EGL context. libGL wants X11, which a bare machine lacks; libOpenGL has the same functions."""
    try:
        ctypes.CDLL("libGL.so.1")
    except OSError:
        os.environ.setdefault("GLCONTEXT_LINUX_LIBGL", "libOpenGL.so.0")
    return offscreen_context()


def pictures(folder: Path, quick: bool) -> dict:
    """Moving frames by OpenGL with 1 and 16 phrases: alone (finished each) and in a row (finished once)."""
    count, atoms, sizes, frames = _plan(quick)
    context, rows = _context(), []
    info = context.info
    told = {"renderer": info["GL_RENDERER"], "driver": info["GL_VERSION"], "frames": frames}
    tiled = [mode for mode in MODES if mode.tiled and context.version_code >= COMPUTE]
    modes = (DEFAULT, next(mode for mode in MODES if mode.fast), *tiled)
    for size in sizes:
        for number in (1, cases.MAX_PHRASES):
            case = cases.synthetic_case(count, atoms, size, frames, number)
            bench = _Bench(context, case, modes)
            _times(bench, lambda *_: None)  # compiles programs, takes memory
            for mode, times in _times(bench, lambda *_: None).items():
                rows.append({
                    "way": mode.name, "size": f"{size[0]}x{size[1]}", "phrases": number,
                    "ms": statistics.median(times.frames), "fps": 1e3 / statistics.median(times.frames),
                    "gpu_ms": statistics.median(times.gpu) if times.gpu else None,
                    "phrase_ms": statistics.median(times.phrases), "row_fps": _in_a_row(bench, mode),
                })  # fmt: skip
            rows.append(_colours_alone(bench, folder, number))
            bench.release()
            found = {**told, "rows": rows}
            (folder / "pictures.json").write_text(json.dumps(found), encoding="utf-8")  # what a limit leaves
    return {**told, "rows": rows}


def _in_a_row(bench: _Bench, mode) -> float:
    """Frames a second with the card's queue kept full."""
    renderer = bench.prepared(mode)
    start = time.perf_counter()
    for frame in range(bench.case.path.num_frames):
        bench.draw(renderer, mode, bench.camera(mode, frame))
        renderer.heat_texture(0)
    bench.ctx.finish()
    return bench.case.path.num_frames / (time.perf_counter() - start)


def _colours_alone(bench: _Bench, folder: Path, number: int) -> dict:
    """Colours without language; the middle frame is kept for the comparison with gsplat."""
    taken = []
    for frame in range(bench.case.path.num_frames):
        renderer = bench.prepared(DEFAULT)
        start = time.perf_counter()
        renderer.draw(bench.camera(DEFAULT, frame), weight_maps=False)
        bench.ctx.finish()
        taken.append(1e3 * (time.perf_counter() - start))
    renderer = bench.prepared(DEFAULT)
    renderer.draw(bench.camera(DEFAULT, bench.case.path.num_frames // 2), weight_maps=False)
    width, height = bench.case.size
    np.save(folder / f"frame-{width}x{height}.npy", renderer.frame().rgb.float().numpy())
    ms = statistics.median(taken)
    return {"way": "colours alone", "size": f"{width}x{height}", "phrases": number, "ms": ms, "fps": 1e3 / ms}


def asking(folder: Path, quick: bool) -> dict:
    """32 phrases at every pixel of two views of 256 x 256, from their weight maps, by torch."""
    count, atoms, side = (2048, 32, 64) if quick else (cases.PAPER_GAUSSIANS, cases.PAPER_ATOMS, 256)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    scene = cases.synthetic_case(count, atoms, (side, side), 1).scene
    found = phrases(scene, 32)
    query = replace(
        found,
        **{n: getattr(found, n).to(device, torch.float32) for n in ("factor", "prompts", "negatives")},
    )
    weights = torch.rand(2, side, side, atoms, device=device)
    ms = milliseconds(lambda: relevance_maps(weights, query), 3 if quick else 20)
    return {"device": device, "views": 2, "size": side, "atoms": atoms, "phrases": 32, "ms": ms}


def build() -> None:
    """Compile gsplat's CUDA code for this card; whoever measures meanwhile waits for it."""
    if torch.cuda.is_available():
        os.environ.setdefault("TORCH_CUDA_ARCH_LIST", "{}.{}".format(*torch.cuda.get_device_capability()))
    with _LOCK.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        from gsplat.cuda._backend import _C  # type: ignore[import-not-found]

        if _C is None:
            raise SystemExit("gsplat has no CUDA code: nvcc was not found")
    sys.stdout.write("gsplat is built\n")


@torch.inference_mode()
def gsplat(folder: Path, quick: bool) -> dict:
    """gsplat on the same scene, way and sizes; our torch rasteriser on the card; PSNR between pictures."""
    build()
    from gsplat import rasterization  # type: ignore[import-not-found]

    count, atoms, sizes, frames = _plan(quick)
    rows = []
    for size in sizes:
        case = cases.synthetic_case(count, atoms, size, frames)
        gaussians = case.scene.gaussians.map(lambda value: value.float().cuda())
        weights = case.scene.semantics.weight_values.float().cuda()
        cameras = [_on_card(camera) for camera in case.path.cameras[1:]]
        middle = case.path.num_frames // 2
        colours = view_colours(gaussians, cameras[middle])

        def draw(camera: Camera, features: torch.Tensor, gaussians: Gaussians = gaussians) -> torch.Tensor:
            return rasterization(
                gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, features,
                camera.viewmat[None], camera.K[None], camera.width, camera.height, near_plane=NEAR,
            )[0][0]  # fmt: skip

        picture = draw(cameras[middle], colours)
        ours = folder / f"frame-{size[0]}x{size[1]}.npy"
        beside = torch.from_numpy(np.load(ours)).cuda() if ours.exists() else None
        for name, features in (("rgb", colours), ("rgb + 16", torch.cat((colours, weights), -1))):
            way = cycle(cameras)
            ms = milliseconds(lambda: draw(next(way), features), frames)  # noqa: B023
            rows.append(_row(f"gsplat {name}", size, ms, _psnr(picture, beside)))
        exact = rasterize(gaussians, colours, cameras[middle])[0]
        ms = milliseconds(lambda: rasterize(gaussians, colours, cameras[middle]), 3)  # noqa: B023
        rows.append(_row("our reference in torch, rgb", size, ms, _psnr(exact, beside)))
        rows.append(_row("gsplat against our reference", size, None, _psnr(picture, exact)))
    return {"frames": frames, "rows": rows}


def _row(way: str, size: tuple[int, int], ms: float | None, psnr: float | None) -> dict:
    fps = None if ms is None else 1e3 / ms
    return {"way": way, "size": f"{size[0]}x{size[1]}", "ms": ms, "fps": fps, "psnr_db_to_opengl": psnr}


def _on_card(camera: Camera) -> Camera:
    return replace(camera, viewmat=camera.viewmat.float().cuda(), K=camera.K.float().cuda())


def _psnr(found: torch.Tensor, expected: torch.Tensor | None) -> float | None:
    """Decibels between pictures (H, W, 3) in [0, 1]."""
    if expected is None:
        return None
    error = (found.clamp(0, 1) - expected.clamp(0, 1)).square().mean().clamp_min(1e-12)
    return float(-10 * error.log10())


STEPS = {"ceilings": ceilings, "pictures": pictures, "asking": asking, "gsplat": gsplat}
