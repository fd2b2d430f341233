"""Colours of the window's pictures alone: of phrases without their own, of features."""

import numpy as np


def hues(count: int) -> np.ndarray:
    """Colours (count, 3): hues a golden angle apart, so that neighbours differ."""
    angles = 2 * np.pi * (0.05 + 0.618034 * np.arange(count)[:, None] + np.array([0.0, 1.0, 2.0]) / 3)
    return (0.55 + 0.4 * np.cos(angles)).astype(np.float32)


def feature_axes(dictionary: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Affine colours (K, 4) of atoms (K, C): three principal axes, and ones for `show_features.frag`.

    The axes are of the atoms as often as the scene carries them, masses (K,) >= 0. Two deviations
    along an axis span its colour; each axis' sign makes its largest entry positive.
    """
    finite = np.where(np.isfinite(dictionary).all(1, keepdims=True), dictionary, 0.0)
    shares = masses / max(masses.sum(), 1e-12)
    centred = finite - shares @ finite
    _, values, axes = np.linalg.svd(np.sqrt(shares)[:, None] * centred, full_matrices=False)
    columns = np.ones((len(finite), 4))
    columns[:, :3] = 0.5
    for place in range(min(3, len(values))):
        if values[place] < 1e-9:  # fewer directions than colours: mid grey
            continue
        along = centred @ axes[place]
        sign = np.sign(along[np.abs(along).argmax()])
        columns[:, place] += sign * along / (4 * values[place])
    return columns
