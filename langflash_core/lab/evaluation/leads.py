"""`langflash lab eval leads`: what phrases start with, learned from labelled photos (`language/leads.py`).

Every photo is asked for every name of its folder, all with the same lead. The border of a name lies midway
between its mean score where it is and where it is not, and counts by how many photos say so. A linear
function of the name's vector foretells it (ridge regression), and takes it from the lead.

Sizes: N photos, P names, C channels, K parts.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch
from jaxtyping import Float, Int
from safetensors.torch import save
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.files import write_atomically
from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.labelled import Drawn, Judged, draw_photo
from langflash_core.lab.evaluation.photo_words import absent_rows
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE
from langflash_core.lab.photos import PhotoFolder
from langflash_core.language.answers import presence_scores
from langflash_core.language.leads import ALL_THE_SAME, Leads
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.settings import ANSWERING, RIVALS

THERE, ABSENT, UNKNOWN = 1, 0, -1
RIDGE = 100.0
"""On the squared length of the direction, beside a sum over names, each by its photos: with 30 names are told
apart as well, and presence errs more on photos never seen."""
SURE = 9.0
"""Log odds beyond which scores are rounding."""


def learned_leads(
    folder: PhotoFolder,
    ids: Sequence[str],
    bench: Bench,
    *,
    progress: Progress = lambda stage, fraction: None,
) -> Leads:
    """Leads for the network of a bench, of some photos of a labelled folder.

    Raises:
        InputError: the folder has no labels, a map cannot be used, or no name is there in one photo and
            absent in another. WeightsError: of the checkpoint.
    """
    judged = Judged.of(folder, bench)
    rows = []
    for done, id in enumerate(ids):
        progress(f"photo {id}, {done + 1} of {len(ids)}", done / len(ids))
        rows.append(_asked(judged, draw_photo(judged, folder.photo(id))[0]))
    scores, truths = (torch.stack(column) for column in zip(*rows, strict=True))
    return fitted_leads(scores, truths, _vectors(judged), judged.space.temperature)


def _vectors(judged: Judged) -> Float[Tensor, "P C"]:
    return judged.vectors[judged.words.rows(judged.words.asked)]


@torch.no_grad()
def _asked(judged: Judged, drawn: Drawn) -> tuple[Float[Tensor, " P"], Int[Tensor, " P"]]:
    """Of every name that may be asked its score in a photo without leads, and whether the photo shows it."""
    words, frame = judged.words, drawn.frame
    assert frame.weight_maps is not None
    space = replace(judged.space, leads=lambda: ALL_THE_SAME)
    maps = relevance_maps(frame.weight_maps, compile_query(drawn.scene, space, words.asked))
    rows = words.asked_of[drawn.ids]
    shares = torch.bincount(rows[rows >= 0], minlength=len(words.asked)) / rows.numel()
    ids = set(drawn.ids.unique().tolist())
    shown = sorted({name.text for id, name in judged.names.items() if id in ids})
    truths = torch.full((len(words.asked),), UNKNOWN)
    truths[absent_rows(shown, words.asked, _vectors(judged), len(words.asked), torch.Generator())] = ABSENT
    truths[shares >= MIN_SHARE] = THERE
    return presence_scores(maps, frame.alphas >= ANSWERING.covered_alpha), truths


def fitted_leads(
    scores: Float[Tensor, "N P"],
    truths: Int[Tensor, "N P"],
    vectors: Float[Tensor, "P C"],
    temperature: float,
) -> Leads:
    """Leads whose mean over the names is `RIVALS.lead`, of scores without leads.

    Raises:
        InputError: no name is there in one photo and absent in another.
    """
    odds = scores.double().logit().clamp(-SURE, SURE)
    there, absent = (truths == THERE).double(), (truths == ABSENT).double()
    shown, hidden = there.sum(0), absent.sum(0)
    judged = (shown > 0) & (hidden > 0)
    if not judged.any():
        raise InputError("no name is there in one photo and absent in another; give more labelled photos")
    borders = ((odds * there).sum(0) / shown + (odds * absent).sum(0) / hidden)[judged] / 2
    photos = (shown * hidden / (shown + hidden))[judged]
    middle = vectors.double().mean(0)
    told = F.pad((vectors.double() - middle)[judged], (0, 1), value=1.0)  # (P', C + 1), the last for the mean
    ridge = torch.full((told.shape[1],), RIDGE, dtype=torch.float64)
    ridge[-1] = 0
    products = told.T @ (photos[:, None] * told) + ridge.diag()
    direction = -torch.linalg.solve(products, told.T @ (photos * borders))[:-1] / temperature
    return Leads(direction.float(), RIVALS.lead - float(middle @ direction))


def write_leads(path: Path, leads: Leads) -> None:
    """As `read_leads` reads them.

    Raises:
        OutputError: it cannot be written.
    """
    write_atomically(path, save({"direction": leads.direction, "offset": torch.tensor(leads.offset)}))
