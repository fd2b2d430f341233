"""How much a reader takes of what strangers send: one table, used by all readers.

Each limit is a number with a name, `langflash info --limits` prints them all, and the environment variable
LANGFLASH_MOST_NAME moves one: `LANGFLASH_MOST_PIXELS=4e8 langflash reconstruct ...`. A limit is inclusive: a
file at it is read, one past it is refused in one sentence that names the variable.
"""

import os
from dataclasses import dataclass

from langflash_core.errors import LangFlashError

_MIB = 2**20


@dataclass(frozen=True)
class Limit:
    """One bound. what: the thing that is counted, for people; unit: "" where that says it."""

    name: str
    default: int
    unit: str
    what: str

    @property
    def variable(self) -> str:
        """The environment variable that moves it."""
        return f"LANGFLASH_MOST_{self.name.upper()}"

    @property
    def value(self) -> int:
        """What counts now: the variable's number where it is one above 0, else the default."""
        try:
            said = int(float(os.environ.get(self.variable, "")))
        except (ValueError, OverflowError):
            return self.default
        return said if said > 0 else self.default

    def told(self, number: int | None = None) -> str:
        """The bound, or `number` of its unit, as people read it."""
        value = self.value if number is None else number
        if self.unit != "bytes":
            return f"{value:,} {self.unit}".rstrip() if self.unit else f"{value:,}"
        for size, word in ((2**30, "GiB"), (_MIB, "MiB"), (2**10, "KiB")):
            if value >= size:
                return f"{value / size:,.4g} {word}"
        return f"{value:,} bytes"

    def passed_by(self, number: int) -> bool:
        """Whether a file asks for more."""
        return number > self.value

    def check(self, number: int, name: str, error: type[LangFlashError]) -> None:
        """A file may hold as many.

        Raises:
            error: it holds more; one sentence with the file's name.
        """
        if self.passed_by(number):
            found = f"{self.told(number)} of {self.name}" if self.unit else f"{number:,} {self.name}"
            raise error(f"{name} holds {found}, more than {self.told()}; {self.remedy()}")

    def remedy(self) -> str:
        """What to do about a file that is known to be good."""
        return f"if you trust it, set {self.variable} higher"


PIXELS = Limit("pixels", 170_000_000, "pixels", "of one photo, or picture of a film or in a scene")
PROFILE = Limit("profile", 4 * _MIB, "bytes", "of a photo's colour profile or EXIF; larger ones are ignored")
GAUSSIANS = Limit("gaussians", 50_000_000, "", "Gaussians of one scene or splat file")
ATOMS = Limit("atoms", 65_536, "", "atoms, the rows of the dictionary of one scene")
VIEWS = Limit("views", 4096, "", "photos of one scene, poses of one file of cameras")
HEADER = Limit("header", 64 * _MIB, "bytes", "the header of a .langflash, the JSON of a .glb or .gltf")
TEXT = Limit("text", 256 * _MIB, "bytes", "a text of cameras, poses, key frames or edits")
FILES = Limit("files", 1000, "", "files packed in one .sog")
SECONDS = Limit("seconds", 120, "seconds", "between two answers of a reader in a process of its own")
MEMORY = Limit("memory", 4096 * _MIB, "bytes", "memory of a reader in a process of its own")

LIMITS = (PIXELS, PROFILE, GAUSSIANS, ATOMS, VIEWS, HEADER, TEXT, FILES, SECONDS, MEMORY)
"""All of them. OpenUSD and the decoders of films, HEIC and AVIF have processes of their own."""
