"""COLMAP on the photos of a walk, as a rival for cameras: pycolmap, where it is installed (BSD, SIFT).

All pairs are matched, as is right for so few photos. All photos share one lens: the one given, which stays,
or one that COLMAP finds, with one number for distortion.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float

from langflash_core.base.optional import optional_packages

SEED = 1


@dataclass(frozen=True)
class Mapped:
    """Cameras of COLMAP's largest model: world to camera (4, 4) by the photo's stem, none where it found no
    model; focal: length in pixels of the photos as given, None without a model; seconds."""

    viewmats: dict[str, Float[np.ndarray, "4 4"]]
    focal: float | None
    seconds: float


def mapped(
    paths: Sequence[Path], intrinsics: tuple[float, float, float, float] | None, threads: int = 1
) -> Mapped:
    """Find the cameras of photos, which lie in one folder.

    Args:
        intrinsics: (fx, fy, cx, cy), pixels of the photos; None: COLMAP seeks the lens, too.

    Raises:
        MissingPackageError: pycolmap is not installed.
    """
    colmap = _colmap()
    start = time.perf_counter()
    with TemporaryDirectory() as folder:
        models = _models(colmap, Path(folder), paths, intrinsics, threads)
    seconds = time.perf_counter() - start
    if not models:
        return Mapped({}, None, seconds)
    largest = max(models, key=lambda model: model.num_reg_images())
    viewmats = {
        Path(image.name).stem: np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]])
        for image in largest.images.values()
        if image.has_pose
    }
    (camera,) = largest.cameras.values()
    return Mapped(viewmats, float(camera.mean_focal_length()), seconds)


def check_installed() -> None:
    """Find out before any work.

    Raises:
        MissingPackageError: pycolmap is not installed.
    """
    _colmap()


def _models(
    colmap: Any, work: Path, paths: Sequence[Path], intrinsics: tuple | None, threads: int
) -> list[Any]:
    """Every model that COLMAP finds."""
    database = work / "database.db"
    names = [path.name for path in paths]
    reader = colmap.ImageReaderOptions()
    reader.camera_model = "SIMPLE_RADIAL"
    if intrinsics is not None:
        reader.camera_model, reader.camera_params = "PINHOLE", ",".join(map(str, intrinsics))
    extraction, matching = colmap.FeatureExtractionOptions(), colmap.FeatureMatchingOptions()
    extraction.num_threads = matching.num_threads = threads
    colmap.set_random_seed(SEED)
    colmap.extract_features(
        database,
        paths[0].parent,
        names,
        colmap.CameraMode.SINGLE,
        reader,
        extraction,
        colmap.Device.cpu,
    )
    colmap.match_exhaustive(database, matching, device=colmap.Device.cpu)
    options = colmap.IncrementalPipelineOptions()
    options.num_threads, options.random_seed = threads, SEED
    options.min_model_size = min(3, len(paths))
    if len(paths) == 2:  # every track is one of two views
        options.triangulation.ignore_two_view_tracks = False
    if intrinsics is not None:
        options.ba_refine_focal_length = options.ba_refine_extra_params = False
    return list(colmap.incremental_mapping(database, paths[0].parent, work, options).values())


def _colmap() -> Any:
    with optional_packages():
        import pycolmap  # type: ignore[import-not-found]
    pycolmap.logging.minloglevel = pycolmap.logging.FATAL  # that nothing was found is a result, too
    return pycolmap
