"""What belongs in which room: the tables behind `layout`. Words are class groups.

A `Step` says where things of some groups go and how many; `{a, b}` choices are drawn at random.
"""

from dataclasses import dataclass

from langflash_core.lab.rooms.catalogue import Item


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split(", "))


@dataclass(frozen=True)
class Step:
    """One rule of a room.

    Attributes:
        where: "wall", "middle", "corner", "hang", "ceiling", "floor" or "counter".
        groups: class groups to draw from.
        low, high: how many, both included.
        follow: groups to put with it, e.g. chairs around a table.
    """

    where: str
    groups: tuple[str, ...]
    low: int = 1
    high: int = 1
    follow: tuple[str, ...] = ()


# How often a room is of each kind. The order is the draw's: another one makes other rooms of every seed.
ROOM_SHARES = (
    ("bedroom", 0.23),
    ("living room", 0.27),
    ("kitchen", 0.17),
    ("bathroom", 0.1),
    ("office", 0.14),
    ("hall", 0.09),
)

_HANGINGS = Step("hang", ("picture", "picture", "picture", "mirror", "clock", "wall lamp"), 1, 5)
_CLUTTER = Step(
    "floor",
    _words("plant, trash bin, bag, toy, box, basket, floor lamp, suitcase, cat, dog, plant, stool, speaker"),
    1,
    5,
)
_SOCKETS = Step("hang", ("switch", "socket", "radiator", "wall tv"), 0, 3)

ROOM_PLANS: dict[str, tuple[Step, ...]] = {
    "bedroom": (
        Step("wall", ("bed", "bed", "bed", "bunk bed", "crib"), 1, 1, ("bedside table",)),
        Step("wall", ("wardrobe", "dresser", "wardrobe"), 1, 2),
        Step("wall", ("desk", "dressing table"), 0, 1, ("chair",)),
        Step(
            "wall", ("bookcase", "armchair", "bench", "tv stand", "radiator", "room divider", "dresser"), 1, 3
        ),
        Step("ceiling", ("ceiling lamp",), 0, 1),
        _HANGINGS,
        _SOCKETS,
        Step("floor", ("rug",), 0, 1),
        Step(
            "floor",
            ("clothes", "pouf", "toy", "teddy bear", "person", "musical instrument", "christmas tree"),
            0,
            2,
        ),
        _CLUTTER,
    ),
    "living room": (
        Step("wall", ("sofa",), 1, 2, ("coffee table",)),
        Step("wall", ("tv stand", "bookcase", "cabinet cupboard"), 1, 2),
        Step("wall", ("armchair", "fireplace", "piano", "bookcase", "dresser", "desk", "room divider"), 2, 4),
        Step("middle", ("table", "coffee table"), 0, 1, ("chair",)),
        Step("middle", ("armchair", "pouf", "stool", "rug"), 0, 2),
        Step("ceiling", ("ceiling lamp", "ceiling fan"), 0, 1),
        _HANGINGS,
        _SOCKETS,
        Step(
            "floor",
            _words(
                "speaker, aquarium, musical instrument, firewood, person, christmas tree, game table, floor "
                "lamp"
            ),
            0,
            2,
        ),
        _CLUTTER,
    ),
    "kitchen": (
        Step(
            "counter",
            _words(
                "base cabinet, stove, dishwasher, refrigerator, sink unit, washing machine, base cabinet, "
                "sink unit"
            ),
            5,
            10,
        ),
        Step("middle", ("table", "kitchen island", "table"), 1, 1, ("chair", "stool")),
        Step("wall", ("refrigerator", "cabinet cupboard", "high chair"), 0, 2),
        Step("ceiling", ("ceiling lamp",), 0, 1),
        Step("hang", ("clock", "picture"), 0, 2),
        _SOCKETS,
        Step(
            "floor",
            ("trash bin", "plant", "basket", "broom", "person", "stool", "water cooler", "fire extinguisher"),
            1,
            4,
        ),
    ),
    "bathroom": (
        Step("wall", ("bathtub", "shower"), 1, 2),
        Step("wall", ("sink",), 1, 1),
        Step("wall", ("toilet",), 1, 1),
        Step("wall", ("washing machine", "bidet", "dresser", "urinal", "drying rack"), 0, 2),
        Step("hang", ("mirror", "towel rack", "toilet paper holder", "water heater", "radiator"), 1, 4),
        Step(
            "floor", ("rug", "basket", "toilet brush", "plant", "trash bin", "stool", "scale", "potty"), 1, 4
        ),
        Step("ceiling", ("ceiling lamp",), 0, 1),
        Step("hang", ("socket", "switch"), 0, 1),
    ),
    "office": (
        Step("wall", ("desk", "desk", "table"), 1, 2, ("chair",)),
        Step("wall", ("bookcase", "bookcase", "cabinet cupboard", "dresser", "safe"), 1, 3),
        Step("middle", ("desk", "table"), 0, 1, ("chair",)),
        Step("wall", ("sofa", "armchair", "printer", "water cooler", "radiator"), 0, 2),
        Step("hang", ("whiteboard", "calendar", "air conditioner"), 0, 1),
        Step("ceiling", ("ceiling lamp",), 0, 1),
        _HANGINGS,
        _SOCKETS,
        _CLUTTER,
    ),
    "hall": (
        Step("wall", ("dresser", "bench", "wardrobe", "hanging clothes", "bookcase"), 1, 3),
        Step("wall", ("armchair", "chair", "table", "stool", "radiator", "ladder", "mannequin"), 1, 3),
        Step(
            "floor",
            _words("bicycle, umbrella, bag, rug, mat, skateboard, stroller, fitness machine, wheelchair"),
            1,
            3,
        ),
        Step("ceiling", ("ceiling lamp",), 0, 1),
        _HANGINGS,
        _SOCKETS,
        _CLUTTER,
    ),
}

_DECOR = ("plant", "vase", "lamp", "book", "book", "candle", "picture frame", "clock")
_KITCHENWARE = _words(
    "cup, bowl, bottle, food, coffee machine, kitchen appliance, toaster, microwave, kettle, teapot, pan, "
    "kitchen utensil, scale, plant, jar"
)

# Supporting group -> (groups of small things, most of them at once).
ON_TOP: dict[str, tuple[tuple[str, ...], int]] = {
    "table": (
        ("cup", "bowl", "bottle", "food", "vase", "plant", "candle", "book", "newspaper", "computer", "tray"),
        6,
    ),
    "desk": (
        _words(
            "computer, computer, lamp, book, cup, stationery, keyboard, phone, printer, headphones, tablet"
        ),
        6,
    ),
    "coffee table": (
        _words("book, cup, bowl, remote control, plant, candle, bottle, tray, glasses, game controller"),
        4,
    ),
    "bedside table": (("lamp", "clock", "book", "phone", "cup", "glasses", "watch"), 2),
    "dresser": ((*_DECOR, "speaker", "camera", "bag", "toy", "tv"), 5),
    "bookcase": ((*_DECOR, "box", "speaker", "toy", "camera", "basket"), 2),
    "tv stand": (("tv", "tv", "speaker", "player", "game controller"), 2),
    "cabinet": (_KITCHENWARE, 3),
    "kitchen island": (_KITCHENWARE, 4),
    "washing machine": (("bottle", "basket", "towel", "box", "soap"), 2),
    "dishwasher": (_KITCHENWARE, 2),
    "refrigerator": (("basket", "bowl", "bottle", "plant", "box"), 1),
    "bed": (("cushion", "cushion", "blanket", "clothes", "teddy bear", "book", "computer", "bag"), 4),
    "sofa": (("cushion", "cushion", "cushion", "bag", "book", "cat", "teddy bear", "blanket"), 4),
    "armchair": (("cushion", "book", "cat", "bag"), 1),
    "chair": (("bag", "book", "clothes", "cushion"), 1),
    "bench": (("bag", "cushion", "clothes", "book"), 2),
    "piano": (("vase", "candle", "book", "plant", "picture frame"), 2),
    "fireplace": (("clock", "vase", "candle", "plant"), 2),
    "toilet": (("toilet paper holder", "bottle"), 1),
    "wardrobe": (("box", "suitcase", "basket", "bag"), 1),
    "game table": ((), 0),
    "dressing table": (("cosmetics", "brush", "comb", "bottle", "lamp", "soap"), 3),
}

# What no rule above asks for, and where it may be. Only makes of the libraries drawn by rules are
# scattered so: rooms of the catalogues stay as they are, and figures of different versions compare.
# They are drawn in the order of the alphabet.
ODDS: dict[str, str] = {
    "ashtray": "top",
    "barrel": "floor",
    "coat hanger": "floor",
    "curtain": "hang",
    "dartboard": "hang",
    "fan": "floor",
    "flashlight": "top",
    "gift": "floor",
    "hob": "top",
    "keys": "top",
    "mattress": "floor",
    "paper towel holder": "top",
    "projector": "top",
    "rabbit": "floor",
    "salt shaker": "top",
    "sleeping bag": "floor",
    "sponge": "top",
    "sports gear": "floor",
    "tool": "top",
    "tricycle": "floor",
}


def role(item: Item) -> str:
    """The word by which rules ask for an item: its group, split where the place differs."""
    name, height = item.name, item.size[1]
    if item.group == "lamp":
        if any(
            word in name
            for word in ("ceiling", "pendant", "hanging", "chandelier", "fluorescent", "track", "spotlight")
        ):
            return "wall lamp" if "wall" in name else "ceiling lamp"
        if "wall" in name or "artwork" in name:
            return "wall lamp"
        return "floor lamp" if height > 1.0 else "lamp"
    if item.group == "cabinet":
        if "upper" in name or (item.elevation > 0.5):
            return "wall cabinet"
        return "base cabinet" if 0.75 < height < 1.0 and item.size[0] < 1.3 else "cabinet cupboard"
    if item.group == "sink":
        return "sink unit" if item.category == "Kitchen" else "sink"
    if item.group == "picture" and height < 0.25:
        return "picture frame"
    if item.group == "stove" and height < 0.6:
        return "hob"
    if item.group == "tv" and item.elevation > 0.5:
        return "wall tv"
    return item.group


def hang_height(item: Item, rng_unit: float) -> float:
    """Height of the foot of a thing on a wall, m, for a uniform draw in [0, 1]."""
    if item.group in {"picture", "mirror", "whiteboard", "projection screen"}:
        return max(1.55 - item.size[1] / 2 + 0.25 * (rng_unit - 0.5), 0.5)
    if item.elevation > 0.02:
        return item.elevation
    usual = {
        "switch": 1.1,
        "socket": 0.25,
        "clock": 1.6,
        "towel rack": 1.1,
        "radiator": 0.12,
        "toilet paper holder": 0.7,
    }
    usual |= {
        "wall lamp": 1.7,
        "air conditioner": 2.0,
        "water heater": 1.2,
        "wall cabinet": 1.45,
        "range hood": 1.55,
    }
    return usual.get(role(item), 1.2)
