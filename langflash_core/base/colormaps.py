"""Colour maps by name: the same in window, files and command line. Read without torch."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from langflash_core.base.formats import COLOUR_MAPS

# Own scale: night blue, violet, red, orange, pale yellow; its luma rises all along, so that it
# also reads in grey and for colour-blind eyes.
HEAT_STOPS = (
    (0.05, 0.05, 0.20), (0.33, 0.07, 0.47), (0.74, 0.15, 0.38), (0.96, 0.47, 0.14), (1.00, 0.80, 0.25),
    (1.00, 0.98, 0.80),
)  # fmt: skip
NUM_STOPS = 31  # of every map as it is drawn, linear between them: five times those of our own, and one


@dataclass(frozen=True)
class HeatColours:
    """How relevance is coloured. span: relevance of the first and the last colour; None: by the threshold."""

    colormap: str = COLOUR_MAPS[0]
    span: tuple[float, float] | None = None

    def ends(self, threshold: float, highest: float = 1.0) -> tuple[float, float]:
        """Relevance of the first and the last colour.

        Without a span of its own the last colour is the `highest` relevance there can be, and what just
        passes is 0.4 up the scale, well away from the dark.
        """
        if self.span is not None:
            return self.span
        room = max(highest - threshold, 1e-6)
        return threshold - room * 2 / 3, threshold + room


@lru_cache
def colour_stops(colormap: str = COLOUR_MAPS[0]) -> np.ndarray:
    """(NUM_STOPS, 3) float32 in [0, 1], evenly spaced, read-only: a colour map as shaders and `heat` draw it.

    Raises:
        ValueError: there is none of this name.
    """
    if colormap not in COLOUR_MAPS:
        raise ValueError(f"colormap: expected one of {COLOUR_MAPS}, received {colormap!r}")
    shares = np.linspace(0, 1, NUM_STOPS)
    if colormap in ("heat", "grey"):
        table = np.array(HEAT_STOPS if colormap == "heat" else ((0.0,) * 3, (1.0,) * 3))
    else:
        import cv2

        bgr = cv2.applyColorMap(np.arange(256, dtype=np.uint8), getattr(cv2, f"COLORMAP_{colormap.upper()}"))
        table = bgr.reshape(-1, 3)[:, ::-1] / 255
    known = np.linspace(0, 1, len(table))
    stops = np.stack([np.interp(shares, known, table[:, c]) for c in range(3)], -1).astype(np.float32)
    stops.flags.writeable = False  # everyone who asks gets this one
    return stops


def colour_bar(colormap: str, width: int = 256) -> np.ndarray:
    """A colour map from left to right, (1, width, 3) uint8.

    Raises:
        ValueError: there is none of this name.
    """
    stops = colour_stops(colormap)
    shares, known = np.linspace(0, 1, width), np.linspace(0, 1, NUM_STOPS)
    return np.stack([255 * np.interp(shares, known, stops[:, c]) + 0.5 for c in range(3)], -1)[None].astype(
        np.uint8
    )
