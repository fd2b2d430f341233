"""Colour maps are one thing: the shaders', the files', the command line's."""

import numpy as np
import pytest
import torch

from langflash_core.base.colormaps import NUM_STOPS, HeatColours, colour_bar, colour_stops
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.export.colours import heat
from langflash_core.export.png import heat_over
from langflash_core.types import LUMA


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_every_map_has_its_stops_and_its_bar(name: str) -> None:
    stops = colour_stops(name)
    assert stops.shape == (NUM_STOPS, 3) and stops.min() >= 0 and stops.max() <= 1
    bar = colour_bar(name)[0] / 255
    assert np.abs(bar - heat(torch.linspace(0, 1, 256), name).numpy()).max() <= 0.5 / 255 + 1e-6


@pytest.mark.parametrize("name", [name for name in COLOUR_MAPS if name != "turbo"])
def test_brightness_tells_high_from_low_without_hue(name: str) -> None:
    """So that colour-blind eyes, and grey prints, read all of them but the rainbow."""
    luma = colour_stops(name) @ np.array(LUMA)
    assert (np.diff(luma) > 0).all() and luma[-1] - luma[0] > 0.5


def test_published_maps_are_the_published_ones() -> None:
    """Ends of viridis and cividis as their authors print them."""
    assert np.allclose(255 * colour_stops("viridis")[[0, -1]], [[68, 1, 84], [253, 231, 37]], atol=1.5)
    assert np.allclose(255 * colour_stops("cividis")[[0, -1]], [[0, 34, 78], [254, 232, 56]], atol=1.5)


def test_a_span_of_ones_own_holds_whatever_the_threshold() -> None:
    assert HeatColours(span=(0.2, 0.9)).ends(0.5) == (0.2, 0.9)
    low, high = HeatColours().ends(0.7)
    assert low < 0.7 and high == pytest.approx(1.0)
    assert (0.7 - low) / (high - low) == pytest.approx(0.4)


def test_files_are_coloured_as_asked() -> None:
    relevance, view = torch.tensor([[0.6, 0.95]]), torch.full((1, 2, 3), 0.5)
    usual = heat_over(relevance, view, 0.5, "relevancy")
    grey = heat_over(relevance, view, 0.5, "relevancy", HeatColours("grey"))
    wide = heat_over(relevance, view, 0.5, "relevancy", HeatColours("grey", (0.0, 1.0)))
    assert not torch.allclose(usual, grey) and torch.allclose(grey[..., 0], grey[..., 2])
    assert wide[0, 0, 0] > 0.1 and wide[0, 0, 0] < wide[0, 1, 0]


def test_an_unknown_map_is_refused() -> None:
    with pytest.raises(ValueError, match="colormap: expected one of"):
        colour_stops("jet")
