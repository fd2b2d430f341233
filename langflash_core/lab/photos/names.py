"""Names of published data sets as people write them, and the usual classes that they count for.

A data set has a spelling of its own ("refridgerator", "night_stand", "wall-other-merged",
"windowpane, window"). `spoken` gives the words to ask and to teach. `class_of` gives one of the
forty classes of NYU Depth v2 (Gupta et al. 2013), where the data set does not say it itself.

Of the 40 classes, 37 are asked: three only say "other".
"""

import re

CLASSES40 = (
    "wall", "floor", "cabinet", "bed", "chair", "sofa", "table", "door", "window", "bookshelf", "picture",
    "counter", "blinds", "desk", "shelves", "curtain", "dresser", "pillow", "mirror", "floor mat", "clothes",
    "ceiling", "books", "refrigerator", "television", "paper", "towel", "shower curtain", "box", "whiteboard",
    "person", "night stand", "toilet", "sink", "lamp", "bathtub", "bag", "other structure", "other furniture",
    "other prop",
)  # fmt: skip
"""In the usual order, in `spoken` words."""
CLASSES37 = CLASSES40[:37]
"""What is asked: "other" is no name."""
_SPOKEN = """
refridgerator: refrigerator
garbage bin: trash bin
bin: trash bin
otherstructure: other structure
otherfurniture: other furniture
otherprop: other prop
scissor: scissors
deoderant: deodorant
ladel: ladle
desser: dresser
excercise machine: exercise machine
excercise equipment: exercise equipment
excercise ball: exercise ball
kichen towel: kitchen towel
styrofoam object: styrofoam
door stuff: door
mirror stuff: mirror
window blind: blinds
window other: window
windowpane: window
wall brick: wall
wall stone: wall
wall tile: wall
wall wood: wall
wall other: wall
floor wood: floor
floor other: floor
water other: water
food other: food
building other: building
sky other: sky
playingfield: playing field
door knob: doorknob
bedclothes: bedding
television receiver: television
cell phone: mobile phone
remote: remote control
tv: television
tvmonitor: television
pottedplant: potted plant
diningtable: dining table
ashcan: trash bin
crt screen: monitor
chest of drawers: dresser
"""

# Kinds and other words of the classes, as the labelled NYU Depth v2 counts them where it has the name
# (a coffee table is "other furniture", a ceiling's light "other structure"); but a rug is a floor mat.
_CLASS = """
cabinet: cupboard; kitchen cabinet; file cabinet
bed: bedstead
chair: armchair; swivel chair; office chair
sofa: couch; settee; loveseat
table: dining table; side table
door: screen door; double door; glass door
window: skylight
bookshelf: bookcase
picture: painting; poster; photograph; framed picture
counter: countertop
blinds: blind; window shade
shelves: shelf
curtain: drapes
dresser: bureau
pillow: cushion
floor mat: rug; carpet; mat; doormat
clothes: shirt; jacket; coat; apparel; trousers
refrigerator: fridge
television: television set
towel: hand towel; bath towel
box: cardboard box; cardboard
night stand: nightstand; bedside table
lamp: table lamp; floor lamp
bag: handbag
other structure: stairs; oven; stove; dishwasher; range hood; air conditioner; fireplace; column
other structure: light; chandelier; banister; blackboard; kitchen island
other furniture: bench; piano; ladder; room divider; tv stand; ottoman; coffee table; pool table
other furniture: wardrobe; crib; bunk bed; headboard; drying rack; washing machine; trash bin
other prop: bottle; cup; bowl; plate; plant; potted plant; vase; flower; clock; book; magazine; computer
other prop: laptop; monitor; keyboard; mouse; printer; microwave; speaker; telephone; mobile phone
other prop: remote control; backpack; suitcase; umbrella; toothbrush; scissors; teddy bear; basket; stool
other prop: toaster; teapot; kettle; fan; candle; jar; food; stuffed animal; wine glass; knife; fork; spoon
other prop: banana; apple; orange
"""


def _rows(table: str) -> list[tuple[str, str]]:
    rows = (line.partition(":") for line in table.strip().splitlines())
    return [(left.strip(), right.strip()) for left, _, right in rows]


_SPELLED = dict(_rows(_SPOKEN))
_CLASS_OF = {name: name for name in CLASSES40} | {
    name.strip(): label for label, names in _rows(_CLASS) for name in names.split(";")
}


def spoken(name: str) -> str:
    """The words for a data set's name: lower case, one space, the first of listed synonyms, no
    suffix of a merged class, correct spelling; unknown names stay what they are."""
    first = name.split(",")[0].lower()
    plain = " ".join(re.sub(r"[^a-z0-9' ]+", " ", first).split())
    plain = plain.removesuffix(" merged")
    return _SPELLED.get(plain, plain)


def class_of(name: str) -> str | None:
    """One of `CLASSES40` for a name of any data set; None where none of them is known to fit."""
    return _CLASS_OF.get(spoken(name))
