"""What people call the things in a room: a checked table of phrases per class group.

`OWN` holds words that mean one group: synonyms, kinds, short descriptions. `BROADER` holds words
that are true of several groups; they are complete, so that such a phrase is false of every other
group of the table. `EVALUATED` is asked by the evaluation and never taught: `is_trainable` refuses it.

Synonyms and hypernyms were looked up in WordNet 3.0 (Princeton University) and chosen by hand.
"""

import re

_OWN = """
wall: side of the room; painted wall; wallpaper; plaster wall; partition between rooms; upright surface
floor: flooring; floorboards; parquet; floor tiles; what people walk on; lower surface of the room
ceiling: top of the room; surface overhead; roof of the room; what is above your head
window: casement; glazing; window frame; glass to look out through; lets daylight in; view of the outside
door: entry door; house door; room door; opens and closes the room; exit; where people walk in
curtain: drapery; window drape; hanging cloth; blind; shades the window; fabric in front of the window
rug: floor covering; area rug; woven floor cloth; soft covering on the floor; persian rug
mat: floor mat; doormat; bath mat; flat pad on the floor
chair: dining chair; seat with a backrest; wooden chair; office chair; seat for one person at a table
armchair: wing chair; recliner; lounge chair; club chair; chair with arm rests; comfortable chair for one
sofa: settee; loveseat; divan; upholstered seat for several people; soft long seat; davenport
stool: footstool; seat without a back; tall seat at the bar; backless chair; high seat at the counter
bench: long wooden seat; backless seat for several people; entry bench
pouf: ottoman; hassock; footrest; padded round seat; soft cube to rest your feet on
high chair: baby chair; feeding chair; tall chair for a toddler
wheelchair: chair on wheels; mobility chair; chair for people who cannot walk
bed: bedstead; double bed; single bed; where people sleep at night; furniture with a mattress
bunk bed: two beds one above the other; raised bed with a ladder; bunks for children
crib: cot; baby bed; cradle; bed with bars for an infant
mattress: air mattress; thick pad to lie down on; futon mattress
sleeping bag: bag for sleeping in a tent; camping bedroll
table: dining table; dinner table; kitchen table; tabletop; flat top on legs; where meals are served
coffee table: low living room table; tea table; table for cups and magazines
desk: writing desk; office desk; school desk; where people write and work; computer desk; workstation
dressing table: vanity table; makeup table; changing table; table with a mirror for grooming
game table: pool table; pinball machine; billiard table; football table; ping pong table
bedside table: night table; bedside cabinet; small table next to the bed
kitchen island: kitchen counter; worktop in the middle of the kitchen; breakfast bar; countertop
cabinet: storage cabinet; kitchen cabinet; sideboard; cupboard with doors; shelves behind doors
bookcase: book rack; shelving; open shelves; shelves full of books; holds books
dresser: chest of drawers; bureau; commode with drawers; holds folded clothes; furniture full of drawers
wardrobe: armoire; clothes closet; closet for coats and dresses; tall cupboard for clothing; hanging closet
tv stand: television bench; media console; tv unit; entertainment center; low media cabinet
safe: strongbox; locker; vault; protects money and valuables
room divider: folding screen; privacy screen; paneled partition; paravent
lamp: light fixture; lighting; electric light; gives light; lights up the room; lampshade; chandelier
candle: wax candle; taper; candlelight; wax with a burning wick
flashlight: electric torch; hand torch; portable light
plant: potted plant; houseplant; flowers; green leaves; flowerpot; living plant; foliage; indoor tree
christmas tree: decorated fir; xmas tree; tree with baubles
vase: flower vase; urn; pottery; ceramic vessel; decorative jar
picture: painting; framed picture; poster; photograph in a frame; wall art
mirror: wall mirror; reflecting surface; where people see themselves; reflects your face
clock: wall clock; alarm clock; tells the time; shows the hour; clock face
watch: wristwatch; worn on the wrist; pocket watch
calendar: shows the date; wall calendar; months and days
tv: television; tv screen; flat screen; display for watching films; telly; what you watch shows on
computer: laptop; desktop computer; pc; notebook computer; imac; machine to work and browse on
tablet: tablet computer; ipad; touch screen; e-reader
keyboard: computer keyboard; keys to type on
printer: inkjet printer; scanner; copier; puts text on paper
phone: telephone; mobile phone; smartphone; cell phone; handset; to call somebody
camera: photo camera; takes photographs; surveillance camera; camcorder
speaker: stereo; radio; hi-fi; sound system; music player; plays music; amplifier
headphones: headset; earphones; worn on the ears
game controller: joystick; gamepad; to play video games with; playstation controller
player: game console; playstation; video game machine; dvd player
remote control: remote; clicker; changes the channel
projector: beamer; film projector; shows pictures on a screen
switch: light switch; wall switch; turns the light on; dimmer
socket: power outlet; wall plug; electrical outlet; where you plug things in
radiator: central heating; hot water radiator; electric heater; gives heat; keeps the house warm
fireplace: hearth; chimney place; open fire; mantelpiece; where logs burn
firewood: logs; wood for burning; stack of wood
air conditioner: air conditioning; climate unit; blows cold air; ac
ceiling fan: fan on the ceiling; turning blades overhead
fan: ventilator; table fan; moves the air
water heater: boiler; hot water tank; makes hot water
water cooler: water dispenser; drinking water machine
refrigerator: fridge; freezer; fridge freezer; keeps milk and vegetables cool; cooling cabinet for groceries
stove: oven; kitchen range; cooktop; hob; heats pots; bakes and roasts; where meals are made
range hood: extractor hood; kitchen hood; cooker exhaust; takes the steam away
dishwasher: dish washing machine; cleans dirty plates; washes dishes
washing machine: washer; clothes washer; tumble dryer; launderette machine; cleans dirty clothes
microwave: microwave oven; warms food quickly
toaster: toasts bread; bread toaster
kettle: boils water; electric kettle; tea kettle
teapot: pot of tea; brews tea; pot with a spout
coffee machine: coffee maker; espresso machine; brews coffee; french press
kitchen appliance: blender; mixer; food processor; sandwich maker
kitchen utensil: kitchen knife; cutlery; cooking spoon; knives; spices
pan: frying pan; saucepan; cooking pot
scale: weighing scale; kitchen scale; measures weight; balance
cup: mug; drinking glass; coffee cup; teacup; tumbler; wine glass; holds coffee or tea
bowl: plate; dish; fruit bowl; tableware; crockery for food; deep plate; saucer
bottle: wine bottle; water bottle; holds wine or water; beer bottle; glass container with a neck; flagon
jar: glass jar; pot with a lid; crock; earthen pot
tray: serving tray; letter tray; flat carrier for cups; paper tray
salt shaker: pepper shaker; salt and pepper; holds salt
food: meal; something edible; fruit; bread; cake; snack; what people eat
sink: washbasin; wash basin; kitchen sink; bathroom sink; basin with a tap; faucet; washstand
bathtub: bath; bathing tub; jacuzzi; tub filled with water; where people bathe
shower: shower stall; shower cabin; shower head; sprays water over you
toilet: toilet bowl; water closet; lavatory bowl; flushes
urinal: men's toilet on the wall; pissoir
bidet: low basin for washing; bathroom bidet
potty: baby toilet; chamber pot; training toilet
toilet brush: lavatory brush; brush for the bathroom
toilet paper holder: toilet roll; toilet paper; roll dispenser
paper towel holder: kitchen roll; paper towels
towel: bath towel; hand towel; cloth to dry yourself
towel rack: towel rail; towel holder; bar for towels
soap: bar of soap; hand soap; soap dish
sponge: bath sponge; cleaning sponge
cosmetics: makeup; lipstick; beauty products
comb: hair comb; teeth for the hair
brush: hair brush; bristles on a handle
trash bin: dustbin; waste basket; wastepaper bin; rubbish bin; recycling bin; trash can; throw waste in here
basket: laundry basket; wicker basket; hamper; shopping basket
box: cardboard box; carton; crate; trunk; package; case with a lid
barrel: wooden cask; keg; drum
bag: backpack; handbag; purse; school bag; satchel; worn over the shoulder; tote
suitcase: luggage; travel case; trolley case; baggage for a trip
clothes: clothing; garments; shoes; shirt; jacket; trousers; hat; what people wear; apparel
hanging clothes: clothes on hangers; coats on a rail; shirts on a rail
coat hanger: clothes hanger; wire hanger
drying rack: clothes horse; clothes airer; dries laundry
umbrella: parasol; keeps the rain off
glasses: eyeglasses; spectacles; sunglasses; reading glasses
cushion: pillow; soft padding to lean on; stuffed square of cloth; headrest
blanket: throw blanket; bed cover; quilt; plaid; keeps you warm
book: books; novel; volume; paperback; textbook; magazine; stack of books; bound pages
newspaper: daily paper; the news; journal
stationery: pencil; pen; stapler; office supplies; scissors; tape; to write with
whiteboard: white board; board for markers; presentation board
gift: present; wrapped box with a ribbon
toy: toys; doll; model train; board game; game for children; what children play with; puzzle
teddy bear: stuffed animal; plush bear; soft toy; cuddly toy
skateboard: longboard; board on four wheels
bicycle: bike; pedal cycle; two wheels and pedals
tricycle: three-wheeled bike; child's trike
stroller: baby carriage; pram; pushchair; buggy
fitness machine: exercise machine; exercise bike; treadmill; gym equipment; punching bag
dartboard: dart game; target for darts
piano: grand piano; upright piano; black and white keys to play; pianoforte
musical instrument: guitar; xylophone; instrument; makes melodies
cat: kitty; feline; kitten; meows
dog: puppy; hound; canine; barks
rabbit: bunny; hare
aquarium: fish tank; tank of fish; glass tank with water
person: human; man; woman; somebody; people; child; girl; boy
mannequin: dummy; human figure for clothes; dress form
ladder: step ladder; rungs; climb up with this
broom: sweeper; mop; sweeps dust
tool: hammer; screwdriver; hand tool
fire extinguisher: puts out flames; red extinguisher
keys: key ring; bunch of keys
ashtray: cigarette tray; for cigarette ends
"""

_SEATS = "chair armchair sofa stool bench pouf high_chair wheelchair"
_BEDS = "bed bunk_bed crib"
_TABLES = "table coffee_table desk dressing_table game_table bedside_table"
_STORAGE = "cabinet bookcase dresser wardrobe tv_stand bedside_table"
_FURNITURE = f"{_SEATS} {_BEDS} {_TABLES} {_STORAGE} kitchen_island room_divider mattress"
_WHITE_GOODS = "refrigerator stove dishwasher washing_machine range_hood microwave"
_SMALL_APPLIANCES = "toaster kettle coffee_machine kitchen_appliance"
_ELECTRONICS = (
    "tv computer tablet keyboard printer phone camera speaker headphones game_controller player "
    "remote_control projector"
)
_BROADER = f"""
chair: chair armchair high_chair wheelchair
table: {_TABLES}
bed: {_BEDS}
lamp: lamp flashlight
rug: rug mat
plant: plant christmas_tree
toilet: toilet potty urinal
bicycle: bicycle tricycle
clothes: clothes hanging_clothes
toy: toy teddy_bear
musical instrument: musical_instrument piano
seating: {_SEATS}
made for sitting: {_SEATS}
furniture that people sit on: {_SEATS}
take a rest here: {_SEATS} {_BEDS}
seat with a back: chair armchair sofa high_chair wheelchair
seat for one: chair armchair stool pouf high_chair wheelchair
upholstered furniture: sofa armchair pouf
living room furniture: sofa armchair pouf coffee_table tv_stand bookcase
bedroom furniture: bed bunk_bed crib wardrobe dresser bedside_table dressing_table
used for sleeping: {_BEDS} mattress sleeping_bag
lie down here: {_BEDS} mattress sofa
furniture: {_FURNITURE}
piece of furniture: {_FURNITURE}
put things on it: {_TABLES} kitchen_island tv_stand dresser
flat surface to work at: table desk kitchen_island
furniture for dining: table kitchen_island
small table: coffee_table bedside_table
furniture to keep things in: {_STORAGE}
storage: {_STORAGE} box basket kitchen_island
cupboard: cabinet wardrobe dresser kitchen_island bookcase bedside_table
shelf: bookcase cabinet tv_stand
drawers: dresser desk bedside_table cabinet
closet: wardrobe cabinet
holds clothes: wardrobe dresser basket suitcase
appliance: {_WHITE_GOODS} {_SMALL_APPLIANCES} air_conditioner water_heater water_cooler fan
household machine: {_WHITE_GOODS} {_SMALL_APPLIANCES} air_conditioner water_heater water_cooler
kitchen equipment: refrigerator stove dishwasher range_hood microwave {_SMALL_APPLIANCES}
white goods: refrigerator stove dishwasher washing_machine
electronics: {_ELECTRONICS}
electronic device: {_ELECTRONICS}
gadget: tablet phone camera headphones game_controller remote_control
screen: tv computer tablet
display: tv computer tablet
audio equipment: speaker headphones
illumination: lamp candle flashlight
shines in the dark: lamp candle flashlight
makes the room bright: lamp window
bathroom fixture: sink bathtub shower toilet urinal bidet
plumbing fixture: sink bathtub shower toilet urinal bidet
where water runs: sink bathtub shower bidet
used for washing: sink bathtub shower
heating: radiator fireplace
heater: radiator fireplace water_heater
dishes: cup bowl
kitchenware: cup bowl bottle jar kettle teapot pan kitchen_utensil tray
drinkware: cup bottle
container: bottle jar box basket barrel vase trash_bin bag suitcase cup bowl
receptacle: bottle jar box basket barrel vase trash_bin
decoration: picture vase plant candle christmas_tree cushion
ornament: vase candle christmas_tree
hangs on the wall: picture mirror clock calendar whiteboard tv dartboard
textile: curtain rug cushion blanket towel clothes mat
fabric: curtain cushion blanket towel clothes
bedding: cushion blanket mattress
reading material: book newspaper
printed pages to read: book newspaper
baggage: suitcase bag
carried by hand: bag suitcase basket umbrella
animal: cat dog rabbit
four-legged friend: cat dog rabbit
living being: cat dog rabbit person plant
exercise equipment: fitness_machine bicycle
vehicle: bicycle tricycle wheelchair stroller skateboard
game: toy game_table dartboard game_controller player
children's room: toy teddy_bear crib bunk_bed
part of the room: wall floor ceiling window door
flat painted surface: wall ceiling
bathroom supplies: soap towel sponge toilet_brush toilet_paper_holder
fire: fireplace candle
"""

_EVALUATED = """
couch: sofa
something to sit on: chair armchair sofa stool bench pouf high_chair wheelchair
seat: chair armchair sofa stool bench pouf high_chair wheelchair
easy chair: armchair
place to sleep: bed bunk_bed crib mattress
light source: lamp candle flashlight
greenery: plant christmas_tree
furniture to eat at: table kitchen_island
cocktail table: coffee_table
work table: desk
nightstand: bedside_table
storage furniture: cabinet bookcase dresser wardrobe tv_stand bedside_table
bookshelf: bookcase
place to store clothes: wardrobe dresser
television set: tv
place to keep food cold: refrigerator
place to cook: stove microwave
laundry machine: washing_machine
carpet: rug
window covering: curtain
windowpane: window
doorway: door
ground under your feet: floor
artwork: picture
looking glass: mirror
timepiece: clock watch
something to read: book newspaper
something to drink from: cup
flask: bottle
holder for flowers: vase
throw pillow: cushion
garbage can: trash_bin
rucksack: bag
place to wash your hands: sink
place to take a bath: bathtub
loo: toilet
something that warms the room: radiator fireplace
loudspeaker: speaker
plaything: toy teddy_bear
pet: cat dog rabbit
keyboard instrument: piano
"""

# Catalogue tags that name a place, a shape, a use or a neighbour, not the thing.
NOT_A_NAME = frozenset(
    """
    outdoor deck patio garden japanese thonet velux corner double round rectangular flat hot cold cabin
    plasma lcd led sliding slide school class kitchen hanging machine conditioner sony motorbike
    motorcycle disabled handicapped baby drink fork knife spoon dinner dining cooker hood candles wash
    dryer coffee photo security surveillance figure female pharmacy music fish electricity electrical
    cleaning clothing sport fitness stereo espresso jewelry appliance laundry puppet throw
    """.split()  # noqa: SIM905
)

_STOP_WORDS = frozenset(
    "a an the to on in at of for from your that this it is something somewhere thing".split()  # noqa: SIM905
)


def _lines(table: str) -> list[tuple[str, str]]:
    rows = (line.partition(":") for line in table.strip().splitlines())
    return [(left.strip(), right.strip()) for left, _, right in rows]


def _group_sets(table: str) -> dict[str, frozenset[str]]:
    return {p: frozenset(g.replace("_", " ") for g in groups.split()) for p, groups in _lines(table)}


OWN: dict[str, tuple[str, ...]] = {
    group: tuple(phrase.strip() for phrase in phrases.split(";")) for group, phrases in _lines(_OWN)
}
"""Class group -> phrases that mean it and no other group of the table."""
BROADER = _group_sets(_BROADER)
"""Phrase -> every class group that it is true of; where a phrase is itself a group, its kinds too."""
EVALUATED = _group_sets(_EVALUATED)
"""Phrases kept for the evaluation -> every class group that they are true of."""


def all_phrases() -> tuple[str, ...]:
    """Every phrase of the tables, class groups first, each once."""
    own = (phrase for phrases in OWN.values() for phrase in phrases)
    return tuple(dict.fromkeys((*OWN, *own, *BROADER, *EVALUATED)))


def content(phrase: str) -> frozenset[str]:
    """The words of a phrase that carry meaning, without plurals: "the shelves" -> {"shelf"}."""
    words = frozenset(re.findall(r"[a-z0-9]+", phrase.lower())) - _STOP_WORDS
    return frozenset(re.sub(r"s$", "", re.sub(r"ves$", "f", word)) for word in words)


_KEPT_BACK = frozenset(content(phrase) for phrase in EVALUATED)


def is_trainable(phrase: str) -> bool:
    """Whether a phrase may be trained on: not one of `EVALUATED`, whatever its articles."""
    return content(phrase) not in _KEPT_BACK


def further_words(group: str) -> tuple[str, ...]:
    """Phrases of the table that are true of a group, without its own name."""
    broader = (phrase for phrase, groups in BROADER.items() if group in groups and phrase != group)
    return tuple(dict.fromkeys((*OWN.get(group, ()), *broader)))


def groups_of(phrase: str) -> frozenset[str]:
    """Groups that a phrase of the table is true of; empty for phrases that the table lacks."""
    own = {group for group, phrases in OWN.items() if phrase == group or phrase in phrases}
    return BROADER.get(phrase, frozenset()) | own


def is_name(tag: str, group: str) -> bool:
    """Whether a catalogue tag names things of this group: "couch" a sofa, not "ceiling" a lamp."""
    known = groups_of(tag)
    return tag not in NOT_A_NAME and (not known or group in known)
