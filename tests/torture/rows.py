"""What a row of `load` says."""

from dataclasses import dataclass, field


@dataclass
class Row:
    """name: of what is done. told: what came of it. finds: what is wrong."""

    name: str
    told: str = ""
    finds: list[str] = field(default_factory=list)
