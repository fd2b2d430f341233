"""Photos whose poses are given: matches say how large each depth map is in the poses' own unit."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from langflash_core.cameras.matching import Matches, triangulate
from langflash_core.errors import InputError
from langflash_core.rig.settings import KNOWN_POSES


def agreeing(matches: Matches, relative: Float[np.ndarray, "4 4"]) -> Matches:
    """Those matches that a pose allows: on each other's epipolar lines, and in front of both cameras.

    Args:
        relative: (4, 4), pos_j = R pos_i + t.
    """
    rotation, shift = relative[:3, :3], relative[:3, 3]
    cross = np.array([[0, -shift[2], shift[1]], [shift[2], 0, -shift[0]], [-shift[1], shift[0], 0]])
    essential = cross @ rotation
    x_i, x_j = (np.c_[x, np.ones(len(x))] for x in (matches.x_i, matches.x_j))
    lines_j, lines_i = x_i @ essential.T, x_j @ essential
    slopes = (lines_j[:, :2] ** 2).sum(1) + (lines_i[:, :2] ** 2).sum(1)
    distances = np.abs((x_j * lines_j).sum(1)) / np.sqrt(np.maximum(slopes, 1e-24))  # Sampson's
    depths = triangulate(matches.x_i, matches.x_j, rotation, shift)
    ahead = (depths > 0) & ((x_i * depths[:, None]) @ rotation[2] + shift[2] > 0)
    return matches.subset((distances < KNOWN_POSES.tolerance * matches.sigma) & ahead)


def count_explained(matches: Matches, relative: Float[np.ndarray, "4 4"]) -> int:
    """How many matches a pose explains, within `KNOWN_POSES.loose` standard deviations: by a point in front
    of both cameras, or by one that is far away.

    Args:
        relative: (4, 4), pos_j = R pos_i + t.
    """
    rotation, shift = relative[:3, :3], relative[:3, 3]
    far = np.c_[matches.x_i, np.ones(len(matches))] @ rotation.T
    depths = triangulate(matches.x_i, matches.x_j, rotation, shift)
    near = far * depths[:, None] + shift
    return int((_meets(far, matches) | ((depths > 0) & _meets(near, matches))).sum())


def _meets(points: Float[np.ndarray, "n 3"], matches: Matches) -> Bool[np.ndarray, " n"]:
    """Whether points in front of camera j are seen where their matches are."""
    ahead = points[:, 2] > 1e-9
    seen = points[:, :2] / np.where(ahead, points[:, 2], 1)[:, None]
    return ahead & (np.linalg.norm(seen - matches.x_j, axis=1) < KNOWN_POSES.loose * matches.sigma)


def doubt(pairs: Sequence[tuple[int, int]]) -> str:
    """What a person is told where photos do not look as their poses say, or nothing.

    Args:
        pairs: of pairs of photos, how many matches the given pose explains, and how many the one that is
            sought without it.
    """
    given, sought = (sum(counts) for counts in zip(*pairs, strict=True)) if pairs else (0, 0)
    if given >= KNOWN_POSES.agreed * sought:
        return ""
    return (
        f"the photos do not look as the poses say: {given} of {sought} matches between them fit; "
        "check that poses, lenses and photos belong together"
    )


def log_scales(
    matches: Matches,
    relative: Float[np.ndarray, "4 4"],
    depths_i: Float[np.ndarray, " n"],
    depths_j: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """What the matches of a pair say each map has to be multiplied by, as logarithms.

    Args:
        depths_i, depths_j: (n,) of the two maps at the matches.
    """
    rotation, shift = relative[:3, :3], relative[:3, 3]
    true_i = triangulate(matches.x_i, matches.x_j, rotation, shift)
    points = np.c_[matches.x_i, np.ones(len(true_i))] * true_i[:, None]
    true_j = points @ rotation[2] + shift[2]
    parallax = np.linalg.norm(shift) / np.maximum(np.minimum(true_i, true_j), 1e-12)
    sure = (true_i > 0) & (true_j > 0) & (parallax > KNOWN_POSES.least_parallax * matches.sigma)
    return np.log(true_i[sure] / depths_i[sure]), np.log(true_j[sure] / depths_j[sure])


def depth_scales(said: list[Float[np.ndarray, " _"]]) -> Float[np.ndarray, " V"]:
    """Factors (V,) from the logarithms that the matches of each view say; of all, where few do.

    Raises:
        InputError: no view has matches enough.
    """
    everything = np.concatenate(said) if said else np.zeros(0)
    if len(everything) < KNOWN_POSES.fewest:
        raise InputError(
            "the photos do not fit the poses: too little of them matches where the poses say it must; "
            "check that poses and photos belong together, or leave --poses out"
        )
    common = np.median(everything)
    return np.exp([np.median(own) if len(own) >= KNOWN_POSES.fewest else common for own in said])
