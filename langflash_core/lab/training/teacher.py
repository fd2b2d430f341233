"""What teaches the late halves: a plain classifier on their tokens, of which the reader of names stays.

A softmax over the 37 classes and one over fine names, read from the tokens of the one half by three thin
layers, and a depth, read from those of the other by as many. Names are rows of a matrix to it, no directions
in the space of texts, so it learns from labels in a quarter of the steps that the language head took (model
card). Afterwards the first two layers of names become the language head's second reader, and the rows of
classes the texts' directions (`hand_over`).

Sizes: B photos, V views, H W pixels, h w the token grid, N names.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.lab.photos.names import CLASSES37, class_of
from langflash_core.lab.training.losses import depth_loss, gradient_loss
from langflash_core.lab.training.shards import NOTHING, Label
from langflash_core.lab.training.stages.pixels import evenly_drawn, nearest
from langflash_core.network.encoders.shared import Tokens, tokens_to_maps
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.prior import resize
from langflash_core.network.semantics.features import LanguageHead, TaughtReader

HIDDEN = 0.1
"""Share of token channels that are hidden from it."""
NAMED_PIXELS = 2500
"""Drawn for fine names, smaller areas denser."""
MIN_ROOMS = 3
"""A name of rendered things counts if so many of them bear it."""
RIDGE = 0.05
"""Of the texts' Gram matrix: names that are nearly alike are not told apart at any price."""
OWN_NORM, TAUGHT_NORM = 1.3, 12.6
"""Frobenius norms of the last layer's two parts after the handing over, whatever they were before: on photos
what the teacher says is then twice as loud as what the head said, and both are small enough for the
learning rate."""
_TYPICAL_LOG_DEPTH = 0.7


@dataclass(frozen=True)
class Rows:
    """Rows of classes (-1 = none) and of names (-1 = none) by label id."""

    classes: Tensor
    names: Tensor


@dataclass(frozen=True)
class Names:
    """All names that are told apart; against (N, N) bool: which speak against which; balance (37,): what
    a pixel of a class counts."""

    texts: tuple[str, ...]
    against: Tensor
    balance: Tensor
    at: dict[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", {text: row for row, text in enumerate(self.texts)})

    @staticmethod
    def of(texts: Sequence[str], against: Tensor, balance: Tensor, rooms: Iterable[Label]) -> "Names":
        """Names of photos, among which `against` says who is whose kind, and of enough rendered things."""
        counts = Counter(label.name for label in rooms)
        known = set(texts)
        more = sorted(name for name, n in counts.items() if n >= MIN_ROOMS and name not in known)
        every = torch.ones(len(texts) + len(more), len(texts) + len(more), dtype=torch.bool)
        every[: len(texts), : len(texts)] = against
        return Names((*texts, *more), every, balance)

    def of_room(self, labels: Sequence[Label]) -> Rows:
        """Rows by instance of one rendered room."""
        classes, names = torch.full((NOTHING + 1,), -1), torch.full((NOTHING + 1,), -1)
        for id, label in enumerate(labels):
            found = (class_of(text) for text in (label.name, label.group, *label.words))
            of = next((text for text in found if text is not None), None)
            classes[id] = CLASSES37.index(of) if of in CLASSES37 else -1
            names[id] = self.at.get(label.name, -1)
        return Rows(classes, names)


class Teacher(nn.Module):
    """Tokens -> logits of classes and names and log depths at twice the grid."""

    def __init__(self, preset: GuidedDepth, names: int):
        super().__init__()
        self.names = names
        self.reader = TaughtReader(preset)
        self.say = nn.Conv2d(preset.taught_feature, len(CLASSES37) + names, 1)
        self.depths = nn.Sequential(TaughtReader(preset, 2), nn.Conv2d(preset.taught_feature, 1, 1))

    def forward(self, tokens: Tokens) -> tuple[Tensor, Tensor, Tensor]:
        """(B*V, 37, 2h, 2w), (B*V, N, 2h, 2w), (B*V, 2h, 2w)."""
        maps = F.dropout2d(tokens.taught_maps(), HIDDEN, self.training)
        classes, names = self.say(self.reader(maps)).float().split((len(CLASSES37), self.names), 1)
        far = torch.cat((tokens.maps(1), tokens_to_maps(tokens.deep[-1].flatten(0, 1), tokens.grid)), 1)
        depths = self.depths(F.dropout2d(far, HIDDEN, self.training)).float()
        return classes, names, depths[:, 0] + _TYPICAL_LOG_DEPTH

    def loss(
        self,
        tokens: Tokens,
        ids: Tensor,
        rows: Rows,
        depths: Tensor,
        names: Names,
        generator: torch.Generator,
    ) -> tuple[Tensor, dict[str, float]]:
        """Cross-entropy of classes, half of that of names, and depth (shape and slopes), at every second
        pixel; ids and depths (B*V, H, W), 0 or NaN where no depth is known."""
        logits, named, logs = self(tokens)
        size = (ids.shape[-2] // 2, ids.shape[-1] // 2)
        classes, balance = nearest(rows.classes.to(ids.device)[ids], size), names.balance.to(logits)
        by_class = F.cross_entropy(resize(logits, size), classes, balance, ignore_index=-1, reduction="sum")
        by_class = by_class / balance[classes[classes >= 0]].sum().clamp_min(1e-6)
        own = nearest(rows.names.to(ids.device)[ids], (named.shape[-2], named.shape[-1])).flatten().cpu()
        chosen = evenly_drawn(own, NAMED_PIXELS, generator)
        truth = own[chosen]
        silent = ~names.against[truth].to(logits.device)
        flat = named.permute(0, 2, 3, 1).flatten(0, 2)[chosen.to(logits.device)].masked_fill(silent, -1e4)
        by_name = F.cross_entropy(flat, truth.to(logits.device), reduction="sum") / max(len(truth), 1)
        logs, truths = resize(logs[:, None], size)[:, 0], nearest(depths, size)
        depth = depth_loss(logs, truths) + 0.5 * gradient_loss(logs, truths)
        told = {"classes": float(by_class.detach()), "names": float(by_name.detach())}
        return by_class + 0.5 * by_name + depth, told | {"depth": float(depth.detach())}


@torch.no_grad()
def hand_over(teacher: Teacher, head: LanguageHead, classes: Tensor) -> None:
    """Let the language head say of photos what the teacher says: its reader, and a last layer W in the
    space of texts with texts W = rows of classes, as nearly as a ridge allows.

    Args:
        classes: unit texts of the 37 classes, (37, C).
    """
    head.taught.load_state_dict(teacher.reader.state_dict())
    rows = teacher.say.weight[: len(classes), :, 0, 0]
    biases = teacher.say.get_parameter("bias")[: len(classes)]
    gram = classes @ classes.T + RIDGE * torch.eye(len(classes)).to(classes)
    solve = torch.linalg.solve(gram, torch.cat((rows, biases[:, None]), 1))
    taught = classes.T @ solve  # (C, F + 1)
    taught *= TAUGHT_NORM / taught[:, :-1].norm().clamp_min(1e-12)
    weight, bias = head.out.get_parameter("weight"), head.out.get_parameter("bias")
    before = weight[:, : -rows.shape[1]]
    quieter = OWN_NORM / before.norm().clamp_min(1e-12)
    before *= quieter
    weight[:, -rows.shape[1] :, 0, 0] = taught[:, :-1]
    bias.copy_(quieter * bias + taught[:, -1])
