"""What people teach a scene: names that groups answer to as well, and words that they no longer answer to.

A lesson moves its atom: towards a name t, d' = normalise(d + t); out of a denied word u,
d' = d - `TEACHING.refused` (d . u) u: beyond a cosine of 0, since negatives may lie below that, too. Atoms
that look alike are moved along, all the way where they are the same and not at all from a cosine of
`TEACHING.alike` down:

    d_j' = normalise(d_j + sum_k s_jk (d_k' - d_k)),
    s_jk = clamp((cos(d_j, d_k) - ALIKE) / (1 - ALIKE), 0, 1).

A lone atom (`langflash_core.scene.lone`) is that of one part of a scene, and moves no other. It goes as far
to the other side, d' = d - 2 (d . u) u: nothing else is lost.

Source: own.
"""

from collections.abc import Mapping, Sequence

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.errors import PromptError
from langflash_core.language.settings import TEACHING
from langflash_core.language.spaces import LanguageSpace, encode_cached
from langflash_core.types import Record


def taught_dictionary(
    dictionary: Float[Tensor, "K C"], record: Record, space: LanguageSpace
) -> Float[Tensor, "K C"]:
    """The dictionary (K, C) as a scene's names and denials have made it; the same without any.

    Raises:
        WeightsError: the space has no text weights.
    """
    lessons = {
        k: (record.atom_names.get(k, ""), record.atom_denials.get(k, ())) for k in _taught_atoms(record)
    }
    texts = dict.fromkeys(text for name, denied in lessons.values() for text in (name, *denied))
    known = {text: row.to(dictionary) for text in texts if (row := _encode_phrase(space, text)) is not None}
    lessons = {k: (name, denied) for k, (name, denied) in lessons.items() if {name, *denied} & known.keys()}
    if not lessons:
        return dictionary
    rows = torch.tensor(list(lessons), device=dictionary.device)
    before = dictionary[rows]
    after = torch.stack(
        [_move_atom(dictionary[k], *lesson, known, k in record.lone_atoms) for k, lesson in lessons.items()]
    )
    unit = normalize(dictionary, dim=-1)
    shares = ((unit @ unit[rows].T - TEACHING.alike) / (1 - TEACHING.alike)).clamp(0, 1)
    lone = torch.tensor([k in record.lone_atoms for k in lessons], device=dictionary.device)
    shares = torch.where(lone, 0.0, shares)
    spread = normalize(dictionary + shares @ (after - before), dim=-1)
    moved = shares.amax(-1, keepdim=True) > 0
    return torch.where(moved, spread, dictionary).index_copy(0, rows, after)


def _taught_atoms(record: Record) -> list[int]:
    return sorted({*record.atom_names, *record.atom_denials})


def _encode_phrase(space: LanguageSpace, text: str) -> Tensor | None:
    """A plain phrase (C,), also where it reads like a sum of others (`algebra`); None for one without a word
    that the tower knows, as people name things."""
    try:
        return encode_cached(space, (text,))[0] if text else None
    except PromptError:
        return None


def _move_atom(
    atom: Tensor, name: str, denied: Sequence[str], known: Mapping[str, Tensor], lone: bool
) -> Tensor:
    """An atom (C,) after its own lesson; 0 where nothing of it is left."""
    if name in known:
        atom = normalize(normalize(atom, dim=0) + known[name], dim=0)
    against = [known[text] for text in denied if text in known]
    if against:
        span = torch.linalg.qr(torch.stack(against, 1))[0]  # (C, n)
        said = span @ (span.T @ atom)
        if not lone and float((atom - said).norm()) <= 1e-3:  # only the words' other side is left
            return torch.zeros_like(atom)
        atom = atom - (2 if lone else TEACHING.refused) * said
    return normalize(atom, dim=0) if float(atom.norm()) > 1e-3 else torch.zeros_like(atom)
