"""Whether a grouping shares encoder and decoder with the geometry, or keeps a copy of its own.

A grouping may have been published with the trunk that it was trained on. If that is the geometry's, number
by number, one of them is enough. If not, both stay: fed with other tokens the grouping would give other
masks (2 % apart moves mask logits by a tenth).
"""

from langflash_core.network.checkpoints.origins import COPY
from langflash_core.network.checkpoints.parts import (
    TRUNK,
    Part,
    fingerprint,
    installed_parts,
    read_tensors,
    write_part,
)
from langflash_core.network.presets import Preset


def settle(preset: Preset) -> tuple[str, ...]:
    """Compare the trunks of what is installed for a preset, and drop a copy that is not needed.

    Returns:
        what was found and what it costs, a sentence each.
    """
    parts = installed_parts(preset)
    grouping = next((part for part in parts if "grouping" in part.modules), None)
    geometry = next((part for part in parts if set(TRUNK) <= set(part.modules)), None)
    if grouping is None or grouping is geometry:
        return ()
    if geometry is None:
        return ()  # compared when there is one
    if not grouping.copies:
        note = mismatch(grouping, geometry.trunk)
        return (note,) if note else ()
    if grouping.reads == (geometry.trunk or fingerprint(read_tensors(geometry, TRUNK))):
        _drop_copy(grouping, preset)
        return ("the grouping was trained on the installed geometry's encoder and decoder, which it shares",)
    return (_cost(grouping, geometry),)


def mismatch(grouping: Part, trunk: str) -> str:
    """A sentence where a grouping without a copy would read tokens that it was not trained on.

    Args:
        trunk: fingerprint of what it would read; "": unknown.
    """
    again = "import its checkpoint again, which brings its own"
    if trunk and grouping.reads and grouping.reads != trunk:
        return f"the grouping was trained on another encoder than the installed geometry's; {again}"
    if not grouping.reads and "LangFlash" in grouping.origin:
        return f"which encoder the grouping was trained on was not kept when it was imported; {again}"
    return ""


def _drop_copy(grouping: Part, preset: Preset) -> None:
    mapped = read_tensors(grouping, set(grouping.modules) - set(grouping.copies))
    kept = {name: value.clone() for name, value in mapped.items()}  # of the file that is written over
    del mapped
    write_part(
        grouping.path, kept, preset, grouping.origin, grouping.source,
        side=grouping.side, reads=grouping.reads,
    )  # fmt: skip


def _cost(grouping: Part, geometry: Part) -> str:
    """What keeping both means: how far they are apart, memory, and time."""
    own, other = read_tensors(grouping, grouping.copies), read_tensors(geometry, TRUNK)
    apart = whole = 0.0
    for name, value in other.items():
        apart += float((own[COPY + name].double() - value.double()).square().sum())
        whole += float(value.double().square().sum())
    size = sum(value.numel() * value.element_size() for value in own.values())
    return (
        "the grouping was trained on an encoder and a decoder of its own, "
        f"{100 * (apart / whole) ** 0.5:.2g} % away from the installed geometry's: both are kept, which "
        f"takes {size / 1e9:,.2g} GB more on disk and in memory (half of it in bfloat16) and runs encoder "
        "and decoder twice"
    )
