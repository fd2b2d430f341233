"""Names of labelled photos through the vocabulary: what a region of a photo is called in training.

A label's name is the fine name in people's spelling, its group the vocabulary's where that knows the
thing, and its class of forty stands among its words as the broader term. Words that the evaluation keeps
for itself give way to the group, also written apart ("night stand") or together.
"""

from langflash_core.lab.photos import Name
from langflash_core.lab.training.shards import Label
from langflash_core.language.vocabulary import EVALUATED, OWN, is_trainable

_KIN = """
bedside table: night stand
lamp: light; light fixture; lantern; sconce
plant: flower; flowers; tree
flower pot: plant pot; flowerpot; pot plant
stationery: ruler; hole puncher; tape dispenser; pencil holder; pencil; marker; stapler; eraser; scissors
kitchen utensil: fork; knife; spoon; spatula; knife rack; ladle; tongs; wooden kitchen utensils
food: banana; apple; orange; sandwich; broccoli; carrot; hot dog; pizza; donut; vegetable; onion; egg
shelves: shelf
coat hanger: hanger
clothes: shoe; shoes; suit jacket; shirt; jacket; coat; belt; sock; tie; apparel
water heater: hot water heater
radiator: heater
toy: toy truck; toy car; toy rectangle; toy house; ball; doll; puzzle
pan: pot; saucepan
game table: foosball table; ping pong table
fitness machine: exercise equipment; treadmill
paper towel holder: paper towel dispenser; paper towel
cabinet: file cabinet; filing cabinet; kitchen cabinet; cupboard
bathtub: bath
musical instrument: drum; guitar; violin
computer: laptop; server; desktop
towel: kitchen towel; hand towel
bag: handbag; purse; backpack; plastic bag; toiletries bag; luggage bag
"""
_APART = frozenset({"faucet", "blinds", "blind", "books", "shelves", "headboard", "mattress"})
"""Names of their own, though the vocabulary has them for a part or a kind of something else."""
_NAMELESS = frozenset({"unknown", "unlabeled", "void", "other", "misc", "object", "machine", "stand"})
"""Say nothing of the thing; their pixels count as not labelled."""


def _kin() -> dict[str, str]:
    rows = (line.partition(":") for line in _KIN.strip().splitlines())
    return {name.strip(): group.strip() for group, _, names in rows for name in names.split(";")}


_GROUP_OF = _kin()


def may_be_taught(phrase: str) -> bool:
    """Whether training may say it: not kept for the evaluation, written in one word or in several."""
    return is_trainable(phrase) and is_trainable(phrase.replace(" ", ""))


def group_of(name: str) -> str:
    """The vocabulary's class group of a spoken name; the name itself where it knows none, or several."""
    if name in _GROUP_OF:
        return _GROUP_OF[name]
    if name in OWN or name in _APART:
        return name
    own = [group for group, phrases in OWN.items() if name in phrases]
    if len(own) == 1:
        return own[0]
    kept = EVALUATED.get(name) or EVALUATED.get(name.replace(" ", "")) or frozenset()
    return next(iter(kept)) if len(kept) == 1 else name


def photo_label(name: Name) -> Label | None:
    """What a region of this name is called; None: it says nothing of the thing, or nothing that may be
    taught ("pet" is true of several groups)."""
    if name.text in _NAMELESS or name.text.startswith("other "):
        return None
    group = group_of(name.text)
    if not may_be_taught(group):
        return None
    text = name.text if may_be_taught(name.text) else group
    broader = name.label
    if (
        broader is None
        or broader.startswith("other ")
        or broader in (text, group)
        or not may_be_taught(broader)
    ):
        return Label(text, group)
    return Label(text, group, (broader,))
