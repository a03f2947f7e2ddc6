"""What a thing is, from the words that a file or a catalogue has for it."""

import re

from toponav.worlds.grid import SemanticClass

__all__ = ["CLASS_OF", "furniture_class", "semantic_of_name"]

_S = SemanticClass

CLASS_OF: dict[str, SemanticClass] = {
    "bed": _S.FURNITURE,
    "child_bed": _S.FURNITURE,
    "bunk_bed": _S.FURNITURE,
    "sofa": _S.SOFA,
    "armchair": _S.SOFA,
    "chair": _S.CHAIR,
    "office_chair": _S.CHAIR,
    "stool": _S.CHAIR,
    "bench": _S.CHAIR,
    "ottoman": _S.SOFA,
    "dining_table": _S.TABLE,
    "coffee_table": _S.TABLE,
    "desk": _S.TABLE,
    "nightstand": _S.FURNITURE,
    "dresser": _S.FURNITURE,
    "wardrobe": _S.FURNITURE,
    "bookcase": _S.BOOKCASE,
    "shelf": _S.BOOKCASE,
    "shoe_rack": _S.FURNITURE,
    "tv_stand": _S.FURNITURE,
    "tv": _S.CLUTTER,
    "computer": _S.CLUTTER,
    "printer": _S.CLUTTER,
    "floor_lamp": _S.CLUTTER,
    "table_lamp": _S.CLUTTER,
    "ceiling_lamp": _S.CLUTTER,
    "wall_lamp": _S.CLUTTER,
    "plant": _S.CLUTTER,
    "vase": _S.CLUTTER,
    "picture": _S.BOARD,
    "white_board": _S.BOARD,
    "mirror": _S.BOARD,
    "clock": _S.CLUTTER,
    "rug": _S.FLOOR,
    "curtain": _S.CLUTTER,
    "refrigerator": _S.FURNITURE,
    "stove": _S.FURNITURE,
    "oven": _S.FURNITURE,
    "dishwasher": _S.FURNITURE,
    "sink": _S.FURNITURE,
    "kitchen_cabinet": _S.FURNITURE,
    "upper_cabinet": _S.FURNITURE,
    "range_hood": _S.FURNITURE,
    "microwave": _S.CLUTTER,
    "washing_machine": _S.FURNITURE,
    "toilet": _S.FURNITURE,
    "bidet": _S.FURNITURE,
    "washbasin": _S.FURNITURE,
    "bathtub": _S.FURNITURE,
    "shower": _S.FURNITURE,
    "towel_rack": _S.CLUTTER,
    "radiator": _S.FURNITURE,
    "fireplace": _S.FURNITURE,
    "piano": _S.FURNITURE,
    "fitness": _S.FURNITURE,
    "filing_cabinet": _S.FURNITURE,
    "coat_rack": _S.FURNITURE,
    "trash_can": _S.CLUTTER,
    "box": _S.CLUTTER,
    "door": _S.DOOR,
    "window": _S.WINDOW,
    "stairs": _S.FURNITURE,
    "clutter": _S.CLUTTER,
}
"""Furniture classes, and what each is in the classes of the simulator."""

# The first rule whose words the name holds decides, so the special stands before the general.
_RULES: tuple[tuple[str, str], ...] = (
    ("picture", r"picture|portrait|painting|frame\b|poster|calendar"),
    ("upper_cabinet", r"upper .*cabinet|upper .*shel|hanging cabinet"),
    ("tv_stand", r"tv ?stand|television ?cabinet|tv ?cabinet|tv ?bench|media console"),
    ("filing_cabinet", r"filing cabinet|file cabinet|drawers? cabinet|locker"),
    ("white_board", r"white ?board|black ?board|^board\b|blackboard"),
    ("towel_rack", r"towel|toilet paper|toilet brush"),
    ("coat_rack", r"coat ?rack|clothes rack|coat ?stand|clothes hanger|hanger|clothes horse"),
    ("shoe_rack", r"shoe ?rack|shoe ?cabinet"),
    ("nightstand", r"night ?stand|night ?table|bedside"),
    ("coffee_table", r"coffee ?table|tea ?table|side ?table|low ?table"),
    (
        "clutter",
        r"coffee (press|maker|machine|brewer|mug|cup)|table(ware| tennis| fan)|"
        r"handle|knob|switch|socket|plug|seasoning|utensil|kitchen tools?",
    ),
    ("table_lamp", r"(desk|table|little|small|bedside) ?lamp"),
    (
        "ceiling_lamp",
        r"chandelier|ceiling ?(lamp|light|fan)|pendant|hanging light|fluorescent|"
        r"track light|downlight",
    ),
    ("wall_lamp", r"wall ?(lamp|light|spotlight)|sconce"),
    ("clutter", r"candle|flashlight|camping lamp|lantern"),
    ("floor_lamp", r"floor ?lamp|standing ?lamp|\blamp\b|\blight ?[a-z]?\b"),
    ("washing_machine", r"washing machine|washer|dryer"),
    ("dishwasher", r"dish ?washer"),
    ("shower", r"shower"),
    ("bathtub", r"bath ?tub|\bbath\b|jacuzzi"),
    ("washbasin", r"wash ?basin|lavatory|vanity|basin"),
    ("sink", r"\bsink"),
    ("bidet", r"bidet"),
    ("toilet", r"toilet|\bwc\b|urinal"),
    ("refrigerator", r"fridge|refrigerator|freezer"),
    ("range_hood", r"\bhood\b|range ?hood"),
    ("microwave", r"microwave"),
    ("stove", r"stove|cooker|cook ?top|cooking ?bench|hob\b"),
    ("oven", r"oven"),
    (
        "kitchen_cabinet",
        r"kitchen ?(cabinet|unit|counter)|lower .*cabinet|counter|island\b|"
        r"high cabinet|small .*cabinet",
    ),
    ("bunk_bed", r"bunk|mezzanine bed"),
    ("child_bed", r"child bed|baby bed|crib|cot\b"),
    ("bed", r"\bbed\b|futon$|tatami|mattress"),
    ("armchair", r"arm ?chair|winchester armchair|relax chair"),
    ("sofa", r"sofa|couch|settee|day bed"),
    ("ottoman", r"ottoman|puff|pouf|hassock"),
    ("office_chair", r"office ?chair|swivel|desk chair|wheeled chair"),
    ("stool", r"stool"),
    ("bench", r"bench"),
    ("chair", r"chair ?[a-z]?\b|\bseat\b"),
    ("desk", r"\bdesk\b|reading ?desk|technical table|work ?bench|dressing table"),
    ("dining_table", r"table ?[a-z]?\b"),
    ("wardrobe", r"wardrobe|closet|armoire"),
    ("dresser", r"dresser|chest|commode|sideboard|cupboard|cabinet|buffet|safe\b"),
    ("bookcase", r"book ?case|book ?shel|full bookcase"),
    ("shelf", r"shelves|shelf|shelving|rack\b"),
    ("tv", r"\btv\b|television|screen|monitor"),
    ("computer", r"computer|laptop|imac|ibook|keyboard|tablet|\bpc\b"),
    ("printer", r"printer|copier|scanner"),
    ("mirror", r"mirror"),
    ("clock", r"clock"),
    ("rug", r"\brug\b|carpet|door ?mat|bath ?mat"),
    ("curtain", r"curtain|blind\b|drape"),
    (
        "plant",
        r"plant\b|ficus|bamboo|yucca|cactus|tulips?|flowers?|orchids?|bonsai|lily|"
        r"spathiphyllum|succulent",
    ),
    ("vase", r"vase|pottery|jar\b"),
    ("radiator", r"radiator|heater|boiler|air ?condition"),
    ("fireplace", r"fire ?place|chimney"),
    ("piano", r"piano"),
    ("fitness", r"treadmill|fitness|indoor bike|abdominal|dumbbell|punching"),
    ("trash_can", r"trash|dust ?bin|recycling bin|\bbin\b|waste"),
    ("box", r"\bbox\b|crate|basket\b|suitcase|trunc?k"),
    ("window", r"window"),
    ("door", r"door ?[a-z]?\b|gate\b"),
    ("stairs", r"stair|escalator|ladder"),
)
_COMPILED = tuple((name, re.compile(pattern)) for name, pattern in _RULES)

_STRUCTURE = (
    (SemanticClass.WINDOW, re.compile(r"window")),
    (SemanticClass.DOOR, re.compile(r"\b(folding ?)?door|doors\b")),
    (SemanticClass.CEILING, re.compile(r"\bceiling\b(?! ?(lamp|light|fan))|\broof\b")),
    (SemanticClass.FLOOR, re.compile(r"\bfloor(ing)?( ?[a-z])?\b(?! ?lamp)|ground( ?plane)?\b")),
    (
        SemanticClass.WALL,
        re.compile(r"\b(house|room|outer|inner)? ?walls?( ?[a-z])?\b(?! ?(lamp|light|clock|tv))"),
    ),
    (SemanticClass.COLUMN, re.compile(r"column|pillar")),
    (SemanticClass.COLUMN, re.compile(r"\bbeam")),
)


def furniture_class(name: str) -> str | None:
    """The furniture class that a name tells, or None.

    Example:
        >>> furniture_class("Glass coffee table"), furniture_class("aws_ReadingDesk_01")
        ('coffee_table', 'desk')
    """
    words = _words(name)
    for found, pattern in _COMPILED:
        if pattern.search(words):
            return found
    return None


def semantic_of_name(name: str) -> SemanticClass | None:
    """The simulator's class that an object's name tells, or None.

    Example:
        >>> semantic_of_name("RoomWall_01"), semantic_of_name("sofa_3_office_12_area_1")
        (<SemanticClass.WALL: 1>, <SemanticClass.SOFA: 8>)
    """
    words = _words(name)
    for kind, pattern in _STRUCTURE:
        if pattern.search(words):
            return kind
    found = furniture_class(name)
    return None if found is None else CLASS_OF[found]


def _words(name: str) -> str:
    """The name in lower-case words: `aws_TVCabinet_01` becomes `aws tv cabinet`."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name[:200])
    return " ".join(re.sub(r"[^a-zA-Z]+", " ", spaced).lower().split())
