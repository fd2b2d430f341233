"""The throw-away classifier: which names speak against which, and its loss against a plain loop."""

import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.losses import depth_loss, gradient_loss
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.teacher import (
    MIN_ROOMS,
    OWN_NORM,
    TAUGHT_NORM,
    Names,
    Rows,
    Teacher,
    hand_over,
)
from langflash_core.network import MINI
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.semantics.features import LanguageHead

AGAINST = torch.tensor([[True, True], [False, True]])
BALANCE = torch.linspace(0.5, 1.5, len(CLASSES37))


@pytest.fixture
def names():
    often = [Label("throne", "chair")] * MIN_ROOMS
    rare = [Label("pouffe", "stool")] * (MIN_ROOMS - 1)
    return Names.of(("chair", "swivel chair"), AGAINST, BALANCE, [*often, *rare, Label("chair", "chair")])


def test_rendered_names_join_and_speak_against_all(names):
    assert names.texts == ("chair", "swivel chair", "throne")
    assert torch.equal(names.against[:2, :2], AGAINST)
    assert names.against[2].all() and names.against[:, 2].all()


def test_rooms_are_told_by_class_and_name(names):
    labels = [Label("throne", "chair"), Label("zither", "musical instrument"), Label("swivel chair", "chair")]
    rows = names.of_room(labels)
    assert [names.texts[row] if row >= 0 else None for row in rows.names[:3].tolist()] == [
        "throne",
        None,
        "swivel chair",
    ]
    chair = CLASSES37.index("chair")
    assert rows.classes[:3].tolist() == [chair, -1, chair]
    assert (rows.classes[3:] == -1).all() and (rows.names[3:] == -1).all(), "255 is nothing"


def test_loss_is_the_weighted_cross_entropy_of_what_is_labelled(names):
    """Classes in double precision, pixel by pixel at half the size; depth by its own losses."""
    torch.manual_seed(0)
    teacher = Teacher(MINI, len(names.texts)).eval()
    hooks = tuple(torch.randn(1, 1, 4, MINI.encoder_dim) for _ in range(4))
    taught = tuple(torch.randn(1, 1, 4, MINI.encoder_dim) for _ in range(3))
    tokens = Tokens(hooks, (2, 2), taught[:2], taught[2:])
    ids = torch.zeros(1, 16, 16, dtype=torch.int64)
    ids[:, :8], ids[:, 8:, :8] = 1, 2
    chair, wall = CLASSES37.index("chair"), CLASSES37.index("wall")
    rows = Rows(torch.tensor([-1, chair, wall]), torch.tensor([-1, 1, -1]))
    depths = torch.rand(1, 16, 16) + 1
    with torch.inference_mode():
        total, told = teacher.loss(tokens, ids, rows, depths, names, torch.Generator().manual_seed(0))
        classes, named, logs = teacher(tokens)
        large = F.interpolate(classes.double(), size=(8, 8), mode="bilinear")[0]
        sums = weights = 0.0
        for y in range(8):
            for x in range(8):
                row = int(rows.classes[ids[0, 2 * y, 2 * x]])
                if row >= 0:
                    weight = float(BALANCE[row])
                    sums += weight * float(large[:, y, x].logsumexp(0) - large[row, y, x])
                    weights += weight
        # Every drawn pixel is a swivel chair, against which "chair" says nothing.
        own = [named[0, :, y, x].double() for y in range(2) for x in range(4)]
        kept = torch.stack([torch.stack((v[1], v[2])).logsumexp(0) - v[1] for v in own])
        logs = F.interpolate(logs[:, None], size=(8, 8), mode="bilinear")[:, 0]
        truths = depths[:, 1::2, 1::2]
        depth = depth_loss(logs, truths) + 0.5 * gradient_loss(logs, truths)
    assert told["classes"] == pytest.approx(sums / weights, rel=1e-5)
    # 8 pixels, one of which is drawn 8 times with equal chances: between the least and the most.
    assert float(kept.min()) <= told["names"] <= float(kept.max())
    assert told["depth"] == pytest.approx(float(depth), rel=1e-5)
    expected = told["classes"] + 0.5 * told["names"] + told["depth"]
    assert float(total) == pytest.approx(expected, rel=1e-5)


def test_the_language_head_says_what_the_teacher_says(names):
    """Classes by the texts as by the rows, where the head itself has nothing to say; texts apart, so the
    ridge shrinks all logits alike."""
    torch.manual_seed(0)
    teacher, head = Teacher(MINI, len(names.texts)).eval(), LanguageHead(MINI).eval()
    torch.nn.init.zeros_(head.out.weight)
    torch.nn.init.zeros_(head.out.get_parameter("bias"))
    texts = torch.linalg.qr(torch.randn(MINI.language_dim, len(CLASSES37))).Q.T
    tokens = Tokens(
        tuple(torch.randn(1, 1, 6, MINI.encoder_dim) for _ in range(4)),
        (2, 3),
        tuple(torch.randn(1, 1, 6, MINI.encoder_dim) for _ in range(2)),
        (torch.randn(1, 1, 6, MINI.encoder_dim),),
    )
    hand_over(teacher, head, texts)
    with torch.inference_mode():
        said = F.interpolate(teacher(tokens)[0], scale_factor=2.0, mode="bilinear")
        own = torch.einsum("pc,chw->phw", texts, head(tokens)[0, 0])
    norms = said.norm(dim=1, keepdim=True)
    torch.testing.assert_close(own[None], said / norms, atol=1e-4, rtol=1e-3)


def test_both_parts_are_as_loud_whatever_the_head_was(names):
    """A head that has learned long, whose taught part is large, begins like a new one."""
    torch.manual_seed(0)
    teacher = Teacher(MINI, len(names.texts))
    texts = torch.linalg.qr(torch.randn(MINI.language_dim, len(CLASSES37))).Q.T
    for factor in (0.1, 10.0):
        head = LanguageHead(MINI)
        weight, bias = head.out.get_parameter("weight"), head.out.get_parameter("bias")
        with torch.no_grad():
            weight.mul_(factor)
            bias.mul_(factor)
        own = weight[:, : -MINI.taught_feature].detach().clone()
        hand_over(teacher, head, texts)
        before, taught = weight.detach().split((own.shape[1], MINI.taught_feature), 1)
        torch.testing.assert_close(before, own * OWN_NORM / own.norm())
        assert float(taught.norm()) == pytest.approx(TAUGHT_NORM, rel=1e-5)


def test_nothing_labelled_teaches_nothing(names):
    teacher = Teacher(MINI, len(names.texts))
    hooks = tuple(torch.randn(1, 1, 4, MINI.encoder_dim) for _ in range(4))
    tokens = Tokens(hooks, (2, 2), hooks[2:], hooks[3:])
    ids, depths = torch.zeros(1, 16, 16, dtype=torch.int64), torch.zeros(1, 16, 16)
    rows = Rows(torch.tensor([-1]), torch.tensor([-1]))
    total, _ = teacher.loss(tokens, ids, rows, depths, names, torch.Generator())
    total.backward()
    assert float(total.detach()) == 0 and all(
        torch.isfinite(p.grad).all() for p in teacher.parameters() if p.grad is not None
    )


def test_names_and_depth_are_read_from_halves_of_their_own(names):
    """What one half gives teaches nothing to the other."""
    torch.manual_seed(0)
    teacher = Teacher(MINI, len(names.texts)).eval()
    hooks = tuple(torch.randn(1, 1, 4, MINI.encoder_dim) for _ in range(4))
    named, far = (torch.randn(1, 1, 4, MINI.encoder_dim).requires_grad_() for _ in range(2))
    classes, fine, logs = teacher(Tokens(hooks, (2, 2), (named, named), (far,)))
    for said, own, other in ((classes.sum() + fine.sum(), named, far), (logs.sum(), far, named)):
        mine, theirs = torch.autograd.grad(said, (own, other), allow_unused=True)
        assert bool(mine.abs().sum() > 0) and theirs is None
