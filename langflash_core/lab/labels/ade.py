"""The names of ADE20K in the order in which DeepLab scores them, in plain words; the first is for all else.

Source: Zhou et al. 2017 (ADE20K), shortened to how people say them.
"""

NAMES = (
    "others", "wall", "building", "sky", "floor", "tree", "ceiling", "road", "bed", "window", "grass",
    "cabinet", "sidewalk", "person", "earth", "door", "table", "mountain", "plant", "curtain", "chair",
    "car", "water", "picture", "sofa", "shelf", "house", "sea", "mirror", "rug", "field", "armchair", "seat",
    "fence", "desk", "rock", "wardrobe", "lamp", "bathtub", "railing", "cushion", "base", "box", "column",
    "sign", "chest of drawers", "counter", "sand", "sink", "skyscraper", "fireplace", "refrigerator",
    "grandstand", "path", "stairs", "runway", "display case", "pool table", "pillow", "screen door",
    "stairway", "river", "bridge", "bookcase", "blinds", "coffee table", "toilet", "flower", "book", "hill",
    "bench", "countertop", "stove", "palm tree", "kitchen island", "computer", "swivel chair", "boat", "bar",
    "arcade machine", "hut", "bus", "towel", "light", "truck", "tower", "chandelier", "awning",
    "street light", "booth", "television", "airplane", "dirt track", "clothes", "pole", "land", "bannister",
    "escalator", "ottoman", "bottle", "sideboard", "poster", "stage", "van", "ship", "fountain",
    "conveyor belt", "canopy", "washing machine", "toy", "swimming pool", "stool", "barrel", "basket",
    "waterfall", "tent", "bag", "motorbike", "cradle", "oven", "ball", "food", "step", "tank", "trade name",
    "microwave", "flowerpot", "animal", "bicycle", "lake", "dishwasher", "projection screen", "blanket",
    "sculpture", "hood", "sconce", "vase", "traffic light", "tray", "trash can", "fan", "pier", "crt screen",
    "plate", "monitor", "bulletin board", "shower", "radiator", "glass", "clock", "flag",
)  # fmt: skip
