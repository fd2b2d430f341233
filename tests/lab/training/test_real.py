"""The stage that real photos teach: what is drawn, what counts for what, and that it learns."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.photos.fitting import fitted
from langflash_core.lab.photos.folder import LabelledPhoto, Name, PhotoFolder
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.live import SIZES, LivePhotos, relit, weathered
from langflash_core.lab.training.real import TEMPERATURE, KeptPhotos, PhotoTargets, named_loss
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.rig.rig import DepthMaps

NAMES = {
    1: Name("wall", "wall"),
    2: Name("chair", "chair"),
    3: Name("swivel chair", "chair"),
    4: Name("zither", "other prop"),
}


def encode(texts):
    """Directions that only depend on the text."""
    seeds = [sum(ord(letter) * 31**place for place, letter in enumerate(text)) % 2**31 for text in texts]
    drawn = [torch.randn(384, generator=torch.Generator().manual_seed(seed)) for seed in seeds]
    return F.normalize(torch.stack(drawn), dim=1)


@pytest.fixture(scope="module")
def photos():
    generator = np.random.default_rng(0)
    made = LivePhotos.__new__(LivePhotos)
    made.photos = []
    for number in range(6):
        labels = np.ones((120, 160), dtype=np.int64)
        labels[60:, :80], labels[60:, 80:], labels[:5] = 2, 3, 0
        if number == 0:
            labels[50:60, 50:60] = 4
        image = generator.integers(0, 255, (120, 160, 3), dtype=np.uint8)
        depths = np.full((120, 160), 2.0, dtype=np.float32)
        made.photos.append(LabelledPhoto(str(number), image, labels, depths, metric=True, K=torch.eye(3)))
    return made


@pytest.fixture(scope="module")
def targets(photos, tmp_path_factory):
    folder = PhotoFolder(tmp_path_factory.mktemp("none"), tuple("012345"), NAMES)
    return PhotoTargets.of(folder, photos, encode)


def test_ids_become_rows_and_rare_names_only_classes(targets):
    assert [CLASSES37[row] for row in targets.class_of[1:4].tolist()] == ["wall", "chair", "chair"]
    assert targets.class_of[0] == targets.class_of[4] == -1  # not labelled; of no class of the 37
    assert targets.fine_of[4] == -1  # one photo shows it
    assert (targets.fine_of[1:4] >= 0).all()
    chair, swivel = targets.fine_of[2], targets.fine_of[3]
    assert not targets.against[swivel, chair], "a swivel chair is a chair"
    assert targets.against[chair, swivel] and targets.against[swivel, swivel]


def test_common_classes_count_less_and_pixels_one_on_average(targets):
    wall, chair = CLASSES37.index("wall"), CLASSES37.index("chair")
    # Half of the rows but the five unlabelled ones are wall: 55 of 115 rows, less the 100 pixels of id 4.
    share = (6 * 55 * 160 - 100) / (6 * 115 * 160 - 100)
    assert float(targets.balance[chair] / targets.balance[wall]) == pytest.approx(
        ((1 - share) / share) ** -0.25, rel=1e-4
    )
    weighted = targets.balance[wall] * share + targets.balance[chair] * (1 - share)
    assert float(weighted) == pytest.approx(1, rel=1e-4)


def test_the_loss_is_the_cross_entropy_of_whoever_is_labelled(targets):
    """Against a plain loop in double precision; features that are the names have nearly none."""
    ids = torch.zeros(1, 8, 8, dtype=torch.int64)
    ids[0, :4], ids[0, 4:, :4], ids[0, 4:, 4:] = 1, 3, 4
    features = F.normalize(torch.randn(1, 384, 8, 8, generator=torch.manual_seed(0)), dim=1)
    total, told = named_loss(features, ids, targets, torch.Generator().manual_seed(0))
    sums = weights = 0.0
    for y in range(8):
        for x in range(8):
            row = int(targets.class_of[ids[0, y, x]])
            if row >= 0:
                logits = TEMPERATURE * targets.classes.double() @ features[0, :, y, x].double()
                weight = float(targets.balance[row])
                sums += weight * float(logits.logsumexp(0) - logits[row])
                weights += weight
    assert told["classes"] == pytest.approx(sums / weights, rel=1e-5)
    assert bool(torch.isfinite(total))
    truth = targets.classes[targets.class_of[ids].clamp_min(0)].permute(0, 3, 1, 2)
    assert named_loss(truth, ids, targets, torch.Generator().manual_seed(0))[1]["classes"] < 0.02


def test_nothing_labelled_gives_a_loss_of_zero(targets):
    features = F.normalize(torch.randn(1, 384, 8, 8), dim=1).requires_grad_()
    total, _ = named_loss(features, torch.zeros(1, 8, 8, dtype=torch.int64), targets, torch.Generator())
    total.backward()
    assert float(total.detach()) == 0
    assert features.grad is not None and bool(torch.isfinite(features.grad).all())


def test_photos_are_drawn_the_same_from_the_same_seed(photos):
    first, second, other = (photos.draw(3, torch.Generator().manual_seed(seed)) for seed in (1, 1, 2))
    assert torch.equal(first.images, second.images) and torch.equal(first.ids, second.ids)
    assert first.images.shape != other.images.shape or not torch.equal(first.images, other.images)
    assert (first.images.shape[-1], first.images.shape[-2]) in SIZES
    assert first.ids.shape == first.depths.shape == first.images[:, 0, 0].shape


@pytest.mark.parametrize("change", [weathered, relit])
def test_weather_changes_light_and_never_the_place_of_things(change):
    picture = torch.zeros(3, 40, 60, dtype=torch.uint8)
    picture[:, 10:30, 20:40] = 200
    for seed in range(40):
        changed = change(picture, torch.Generator().manual_seed(seed))
        assert changed.shape == picture.shape and changed.dtype == torch.uint8
        bright = changed.float().mean(0)
        assert bright[14:26, 24:36].mean() > bright[:6].mean() + 30, seed


def test_a_few_steps_teach_names_and_end_in_a_cut_half(photos, targets, tmp_path):
    """Photos of two classes in two colours, six steps: the loss falls, and the run can be read again."""
    from langflash_core.lab.training.loop import LoopOptions
    from langflash_core.lab.training.real import MODULES, JointSet, train_late
    from langflash_core.lab.training.shards import Label
    from langflash_core.lab.training.stages.stage import Words
    from langflash_core.lab.training.states import load_averaged
    from langflash_core.lab.training.words import PhraseSampler, build_table
    from langflash_core.network import MINI
    from langflash_core.network.build import build_network
    from langflash_core.network.encoders.late import LateHalf

    coloured = LivePhotos.__new__(LivePhotos)
    tints = np.array([[0, 0, 0], [220, 30, 30], [30, 30, 220], [30, 200, 30], [90, 90, 90]], dtype=np.uint8)
    coloured.photos = [replace(photo, image=tints[photo.labels]) for photo in photos.photos]

    torch.manual_seed(0)
    network = build_network(MINI)
    network.begin_halves()
    table = build_table([Label("chair", "chair")], encode)
    words = Words(PhraseSampler(table), torch.Generator().manual_seed(0))
    options = LoopOptions(minutes=10, max_steps=6, report_s=0.0, pictures=2, learning_rate=3e-3)
    state = train_late(network, targets, JointSet(coloured, None), words, tmp_path, options)
    assert state.step == 6 and isinstance(network.late, LateHalf)
    for part in ("late_whole", "late_heads"):
        rows = [line for line in (tmp_path / f"{part}.jsonl").read_text().splitlines() if "classes" in line]
        losses = [float(line.split('"classes": ')[1].split(",")[0].rstrip("}")) for line in rows]
        assert losses[-1] < losses[0] and math.isfinite(losses[-1]), part
    assert not hasattr(network, "teacher"), "it is no part of the network"
    fresh = build_network(MINI)
    assert load_averaged(fresh, tmp_path, "late") == (6, pytest.approx(state.seconds))
    ours, theirs = network.state_dict(), fresh.state_dict()
    for name in MODULES:
        for key in (key for key in ours if key.startswith(f"{name}.")):
            assert torch.equal(ours[key], theirs[key]), key
    for half in (network.late, network.deep):
        assert float(half.get_parameter("blocks.0.qkv.up").detach().abs().max()) > 0
    saved = torch.load(tmp_path / "late.pt", weights_only=True)
    saved["ema"] = {name: value for name, value in saved["ema"].items() if not name.startswith("deep.")}
    torch.save(saved, tmp_path / "late.pt")  # as runs left it before depth had a half of its own
    assert load_averaged(fresh, tmp_path, "late") is not None
    for key, value in network.late.state_dict().items():
        assert torch.equal(fresh.deep.state_dict()[key], value), key


def test_kept_photos_judge_by_names_and_by_depth(photos, targets):
    """A network that knows every pixel's class and half of every depth: all right, up to the scale."""

    class Knowing(GuidedDepthNet):
        def __init__(self):
            torch.nn.Module.__init__(self)
            self.turn = 0

        def encode(self, images, Ks):
            return Tokens((), (1, 1))

        def language(self, tokens, images):
            view = fitted(photos.photos[self.turn], SIZES[0])
            truth = targets.classes[targets.class_of[view.labels].clamp_min(0)]
            return truth.permute(2, 0, 1)[None, None]

        def monocular_depth(self, tokens, Ks):
            view = fitted(photos.photos[self.turn], SIZES[0])
            self.turn += 1
            depths = view.depths.log()[None, None] - math.log(2)
            return DepthMaps(depths, torch.zeros_like(depths))

    found = KeptPhotos(photos, targets)(Knowing())
    expected = {"classes_accuracy": 1.0, "classes_miou": 1.0, "abs_rel": 0.0, "delta1": 1.0}
    assert found == pytest.approx(expected, abs=1e-6)
