"""Our measures against other people's: torchmetrics, scikit-image and pycocotools, on a fixed seed.

Where a package is installed it is asked anew; what it said once (torchmetrics 1.9.0, scikit-image 0.26.0,
pycocotools 2.0.11) is written beside, so that the comparison holds without it as well. Both must agree to
1e-6 of numbers near 1; torchmetrics counts in float32.
"""

import importlib.util

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.metrics import calibration_error
from langflash_core.lab.evaluation.segments import panoptic
from langflash_core.lab.evaluation.sharp_measures import ssim
from langflash_core.lab.training.measures import (
    abs_rel,
    accuracy,
    confusion,
    delta1,
    occurring_mean_iou,
    psnr,
)


def other(name: str):
    """A module of somebody else's, or the test ends here."""
    package = name.partition(".")[0]
    if package in ("torchmetrics", "lpips") and importlib.util.find_spec(package) is not None:
        ensure_torchvision()
    return pytest.importorskip(name)


SAID = {
    "jaccard": 0.4299118,
    "accuracy": 0.6668286,
    "ssim": 0.5836099,
    "psnr": 20.1928473,
    "panoptic": 0.4325913,
    "calibration": 0.1680745,
    "abs_rel": 0.1508946,
}
CLASSES = 9


def label_maps() -> tuple[torch.Tensor, torch.Tensor]:
    """Prediction and truth of 0 to 8; class 7 is in neither, class 8 is only predicted, 0 is no label."""
    generator = torch.Generator().manual_seed(4)
    truth = torch.randint(0, 7, (60, 80), generator=generator)
    found = torch.where(
        torch.rand(60, 80, generator=generator) < 0.6,
        truth,
        torch.randint(1, 7, (60, 80), generator=generator),
    ).clamp_min(1)
    found[:4, :4] = 8
    return found, truth


def pictures() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(5)
    coarse = torch.rand(1, 3, 6, 8, generator=generator, dtype=torch.float64)
    photo = torch.nn.functional.interpolate(coarse, size=(48, 64), mode="bicubic")[0].clamp(0, 1)
    noise = 0.1 * torch.randn(photo.shape, generator=generator, dtype=torch.float64)
    return (photo + noise).clamp(0, 1).permute(1, 2, 0), photo.permute(1, 2, 0)


def segment_maps():
    """Segments of 8 x 8 blocks, some of them moved and some called wrongly; the last rows are no segment."""
    generator = np.random.default_rng(6)
    truth = np.add.outer(np.arange(48) // 8 * 8, np.arange(64) // 8)
    truth[40:] = -1
    found = np.roll(truth, 2, axis=1)
    classes = {int(i): int(i) % 5 for i in np.unique(truth)}
    named = {i: c if generator.random() < 0.7 else (c + 1) % 5 for i, c in classes.items()}
    found[found < 0] = 999
    return found, truth, named | {999: 2}, classes


def scores() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(7)
    values = torch.rand(500, generator=generator)
    return values, torch.rand(500, generator=generator) < values**2


def counted(found: torch.Tensor, truth: torch.Tensor) -> torch.Tensor:
    """Confusion with class 0 left out, as protocols do that ignore it."""
    return confusion(found.flatten() - 1, truth.flatten() - 1, CLASSES - 1)


def test_mean_iou_is_that_of_torchmetrics():
    found, truth = label_maps()
    ours = occurring_mean_iou(counted(found, truth))
    assert ours == pytest.approx(SAID["jaccard"], abs=1e-6)
    classification = other("torchmetrics.classification")
    metric = classification.MulticlassJaccardIndex(CLASSES, ignore_index=0)
    assert ours == pytest.approx(float(metric(found, truth)), abs=1e-6)


def test_accuracy_is_that_of_torchmetrics():
    found, truth = label_maps()
    ours = accuracy(counted(found, truth))
    assert ours == pytest.approx(SAID["accuracy"], abs=1e-6)
    classification = other("torchmetrics.classification")
    metric = classification.MulticlassAccuracy(CLASSES, ignore_index=0, average="micro")
    assert ours == pytest.approx(float(metric(found, truth)), abs=1e-6)


def test_ssim_is_that_of_scikit_image():
    rendered, photo = pictures()
    ours = ssim(rendered, photo)
    assert ours == pytest.approx(SAID["ssim"], abs=1e-6)
    metrics = other("skimage.metrics")
    theirs = metrics.structural_similarity(
        rendered.numpy(), photo.numpy(), channel_axis=2, data_range=1.0, gaussian_weights=True,
        sigma=1.5, use_sample_covariance=False,
    )  # fmt: skip
    assert ours == pytest.approx(theirs, abs=1e-6)


@pytest.mark.filterwarnings("ignore::UserWarning:torchvision")  # lpips calls it as it was years ago
def test_lpips_is_that_of_its_package(tmp_path):
    lpips = other("lpips")
    torch.manual_seed(3)
    theirs = lpips.LPIPS(net="vgg", pretrained=False, pnet_rand=True, verbose=False).eval()
    state = theirs.state_dict()
    renamed = {f"features.{k.split('.')[2]}.{k.split('.')[3]}": v for k, v in state.items() if ".slice" in k}
    renamed |= {f"lin{n}.model.1.weight": state[f"lin{n}.model.1.weight"].abs() for n in range(5)}
    heads = {name: value for name, value in renamed.items() if name.startswith("lin")}
    theirs.load_state_dict(heads, strict=False)
    save_file({name: value.contiguous() for name, value in renamed.items()}, tmp_path / "vgg.safetensors")
    rendered, photo = (p.float()[None] for p in pictures())
    with torch.no_grad():
        expected = theirs(rendered.permute(0, 3, 1, 2), photo.permute(0, 3, 1, 2), normalize=True).item()
    ours = Lpips(tmp_path / "vgg.safetensors")
    assert ours.whole(rendered, photo) == pytest.approx([expected], rel=1e-5)  # float32 in both
    assert ours.whole(photo, photo) == [0]


def test_psnr_is_that_of_scikit_image():
    rendered, photo = pictures()
    assert psnr(rendered, photo) == pytest.approx(SAID["psnr"], abs=1e-6)
    metrics = other("skimage.metrics")
    theirs = metrics.peak_signal_noise_ratio(photo.numpy(), rendered.numpy(), data_range=1.0)
    assert psnr(rendered, photo) == pytest.approx(theirs, abs=1e-6)


def test_panoptic_quality_is_that_of_torchmetrics():
    found, truth, named, classes = segment_maps()
    ours = panoptic(found, truth, named, classes).mean()
    assert ours == pytest.approx(SAID["panoptic"], abs=1e-6)
    detection = other("torchmetrics.detection")
    metric = detection.PanopticQuality(things=set(range(5)), stuffs={9}, allow_unknown_preds_category=True)

    def stacked(ids, kinds):
        kind = np.vectorize(lambda i: kinds.get(int(i), 77))(ids)
        return torch.from_numpy(np.stack([kind, ids], -1))[None]

    void = dict(classes)
    void.pop(-1, None)
    theirs = metric(stacked(found, named), stacked(truth, void))
    assert ours == pytest.approx(float(theirs), abs=1e-6)


def test_the_calibration_error_is_that_of_torchmetrics():
    values, truths = scores()
    ours = calibration_error(values, truths)
    assert ours == pytest.approx(SAID["calibration"], abs=1e-6)
    classification = other("torchmetrics.classification")
    metric = classification.BinaryCalibrationError(n_bins=20, norm="l1")
    assert ours == pytest.approx(float(metric(values, truths.long())), abs=1e-6)


def test_relative_depth_is_the_mean_percentage_error_of_torchmetrics():
    generator = torch.Generator().manual_seed(8)
    truth = torch.rand(40, 50, generator=generator) + 0.5
    depths = truth * (0.7 + 0.6 * torch.rand(40, 50, generator=generator))
    assert abs_rel(depths, truth) == pytest.approx(SAID["abs_rel"], abs=1e-6)
    assert 0 < delta1(depths, truth) < 1
    regression = other("torchmetrics.regression")
    assert abs_rel(depths, truth) == pytest.approx(
        float(regression.MeanAbsolutePercentageError()(depths.flatten(), truth.flatten())), abs=1e-6
    )


def test_ious_of_masks_are_those_of_pycocotools():
    mask = other("pycocotools.mask")
    found, truth = label_maps()
    ious = []
    for label in range(1, CLASSES):
        own = np.asfortranarray((found == label) & (truth > 0), dtype=np.uint8)
        real = np.asfortranarray(truth == label, dtype=np.uint8)
        if own.any() or real.any():
            ious.append(float(mask.iou([mask.encode(own)], [mask.encode(real)], [0])[0, 0]))
    assert occurring_mean_iou(counted(found, truth)) == pytest.approx(np.mean(ious), abs=1e-9)
