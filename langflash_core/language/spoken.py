"""Phrases as people say them, made ready for a scene: heads for language, readings for what narrows them."""

from collections.abc import Sequence
from dataclasses import replace

from langflash_core.errors import PromptError
from langflash_core.language.grammar import Reading, read_phrase
from langflash_core.language.hints import hints
from langflash_core.language.relevance import CompiledQuery, Mode, compile_query
from langflash_core.language.settings import SPOKEN
from langflash_core.language.spaces import LanguageSpace, encode_cached
from langflash_core.language.vocabulary import OWN
from langflash_core.language.words import nearest_words
from langflash_core.types import Scene, Semantics


def compile_spoken(
    scene: Scene | Semantics,
    space: LanguageSpace,
    prompts: Sequence[str],
    *,
    negatives: Sequence[str] | None = None,
    mode: Mode = "relevancy",
) -> CompiledQuery:
    """`compile_query` of the heads of phrases as people say them (`grammar.py`), with their readings.

    Raises:
        as `compile_query`.
    """
    if isinstance(prompts, str):
        raise PromptError("there is no prompt; give a list with at least one word or short phrase")
    taught = tuple(scene.record.atom_names.values()) if isinstance(scene, Scene) else ()
    readings = tuple(read_phrase(prompt, taught) for prompt in prompts)
    heads = [reading.head for reading in readings]
    compiled = compile_query(scene, space, heads, negatives=negatives, mode=mode)
    told = tuple(prompt.strip() for prompt in prompts)
    notes = tuple(
        "; ".join(filter(None, (note, _unread(reading), _unknown(reading, note, space))))
        for reading, note in zip(readings, compiled.notes, strict=True)
    )
    named = tuple(dict.fromkeys(head for reading in readings for head in reading.heads[1:]))
    others = compile_query(scene, space, named, negatives=negatives, mode=mode) if named else None
    return replace(compiled, texts=told, notes=notes, readings=readings, others=others)


def phrase_notes(
    scene: Scene | Semantics, prompts: Sequence[str], *, narrowing: bool = True
) -> tuple[str, ...]:
    """What people should know of phrases before they are answered, or "".

    Args:
        narrowing: whether what answers them chooses among what answers their heads.
    """
    taught = tuple(scene.record.atom_names.values()) if isinstance(scene, Scene) else ()
    readings = [read_phrase(prompt, taught) for prompt in prompts]
    said = hints(scene, [reading.head for reading in readings])
    return tuple(
        "; ".join(filter(None, (hint, _unread(reading), "" if narrowing else _widening_note(reading))))
        for reading, hint in zip(readings, said, strict=True)
    )


def _widening_note(reading: Reading) -> str:
    return f'this shows every "{reading.head}", not only "{reading}"' if reading.narrows else ""


def _unread(reading: Reading) -> str:
    words = " and ".join(f'"{word}"' for word in reading.ignored)
    return f'{words} says nothing that can be checked here, so this is "{reading}"' if words else ""


def _unknown(reading: Reading, note: str, space: LanguageSpace) -> str:
    """What a head that names no known thing is near to; nothing where something was said of it already."""
    if reading.known or note or space.name != "minilm" or len(reading.head.split()) > SPOKEN.most_of_a_name:
        return ""
    words = tuple(OWN)
    (near,) = nearest_words(space.encode([reading.head])[0], words, encode_cached(space, words), 1)
    nearest = (
        f'the nearest one it knows is "{near.word}"'
        if near.cosine >= SPOKEN.near
        else "it knows none that is near"
    )
    return f'"{reading.head}" is no thing that this model was taught; {nearest}'
