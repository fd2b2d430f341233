"""Colours have the names that people give them, whatever the light of the room."""

import numpy as np
import pytest

from langflash_core.language.looks import LOOKS, TONES, lab, linear, looking, room_white, tinted

REFLECTING = {  # linear light, of a hundred, of paints and woods in daylight
    "white": (84, 84, 82), "grey": (24, 24, 24), "black": (3, 3, 3), "red": (38, 5, 5), "orange": (62, 22, 4),
    "brown": (13, 7, 3.5), "yellow": (74, 55, 8), "green": (8, 20, 9), "turquoise": (8, 30, 31),
    "blue": (5, 11, 40), "purple": (16, 6, 22), "pink": (72, 33, 42), "beige": (64, 54, 38),
}  # fmt: skip
LIGHTS = {"day": (1, 1, 1), "warm": (1, 0.74, 0.5), "cold": (0.72, 0.88, 1), "dim": (0.22, 0.2, 0.17)}


def photographed(colour: tuple[float, ...], light: tuple[float, ...]) -> np.ndarray:
    """sRGB (1, 3) of a surface under a light."""
    shown = np.clip(np.array([colour]) / 100 * np.array(light), 0, 1)
    return np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)


def room(light: tuple[float, ...]) -> np.ndarray:
    """What a room shows under a light: walls half in shade, and a patch of each colour."""
    shades = np.linspace(0.35, 1, 400)
    walls = [photographed(tuple(np.array(REFLECTING["white"]) * shade), light) for shade in shades]
    return np.concatenate(
        walls + [photographed(each, light) for each in REFLECTING.values() for _ in range(10)]
    )


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", REFLECTING)
def test_a_colour_keeps_its_name_under_any_light(name: str, light: str) -> None:
    """It is called so, and no other of the thirteen fits better."""
    shown = photographed(REFLECTING[name], LIGHTS[light])
    colours = lab(shown, room_white(room(LIGHTS[light])))
    well = {each: float(looking(colours, each)[0]) for each in REFLECTING}
    assert well[name] >= 0.5 and well[name] == max(well.values()), well


def test_without_the_white_of_the_room_warm_light_has_other_names() -> None:
    shown = photographed(REFLECTING["white"], LIGHTS["warm"])
    assert looking(lab(shown, np.ones(3)), "white") < 0.5


def test_a_wooden_table_in_the_light_is_not_taken_for_white() -> None:
    """It is about as bright as the walls, and more of what is bright is wood."""
    grain = np.linspace((90, 75, 50), (90, 78, 66), 55)
    some = [*[(10, 10, 10)] * 900, *[REFLECTING["white"]] * 45, *grain]
    picture = np.concatenate([photographed(tuple(each), LIGHTS["day"]) for each in some])
    beige = lab(photographed(REFLECTING["beige"], LIGHTS["day"]), room_white(picture))
    assert looking(beige, "beige")[0] >= 0.5 > looking(beige, "white")[0]


def test_what_stands_in_more_light_than_white_keeps_its_colour() -> None:
    lilac = photographed((42, 22, 58), (2, 2, 2))
    assert looking(lab(lilac, np.full(3, 0.4)), "purple")[0] >= 0.5


def test_a_tint_is_a_hue_however_dark_or_pale() -> None:
    dim_misty_grey = np.array([[22, 12, 13.0], [80, 6, 7.5], [60, 1, 1]])
    assert (looking(dim_misty_grey, "orange") < 0.5).all()
    assert tinted(dim_misty_grey, "orange").round().tolist() == [1, 1, 0]
    assert (tinted(dim_misty_grey, "blue") == 0).all()
    assert (tinted(dim_misty_grey, "grey") == looking(dim_misty_grey, "grey")).all()


def test_linear_light_is_that_of_srgb() -> None:
    """Middle grey, and both parts of the curve: IEC 61966-2-1 to the four digits of its table."""
    light = linear(np.array([[0.0, 0.04, 0.5], [1.0, 2.0, np.nan]]))
    assert np.allclose(light, [[0, 0.0031, 0.2140], [1, 1, 0]], atol=5e-5)


def test_lab_is_that_of_the_standard() -> None:
    """sRGB red, and white: CIE 15 with D65, to the rounding of four-digit matrices."""
    colours = lab(np.array([[1.0, 0, 0], [1, 1, 1]]), np.ones(3))
    assert np.allclose(colours, [[53.24, 80.09, 67.20], [100, 0, 0]], atol=0.05)


def test_dark_and_light_say_nothing_of_the_hue() -> None:
    navy, sky = (lab(np.array([rgb]), np.ones(3)) for rgb in ((0.05, 0.12, 0.4), (0.6, 0.8, 0.95)))
    assert looking(navy, "dark") == 1 and looking(navy, "blue") > 0.5 and looking(navy, "light") == 0
    assert looking(sky, "light") == 1 and looking(sky, "blue") > 0.5 and looking(sky, "dark") == 0


def test_wood_is_wooden_and_steel_metallic() -> None:
    oak, steel = (lab(np.array([rgb]), np.ones(3)) for rgb in ((0.72, 0.53, 0.34), (0.55, 0.56, 0.57)))
    assert looking(oak, "wooden") > 0.5 > looking(steel, "wooden")
    assert looking(steel, "metallic") > 0.5 > looking(oak, "metallic")


def test_nothing_and_black_have_a_white_too() -> None:
    assert (room_white(np.zeros((0, 3))) == 1).all()
    assert np.isfinite(lab(np.zeros((5, 3)), room_white(np.zeros((5, 3))))).all()


def test_other_words_mean_looks_that_there_are() -> None:
    assert set(TONES.values()) <= set(LOOKS) and not set(TONES) & set(LOOKS)
