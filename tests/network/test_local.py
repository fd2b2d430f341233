"""The frozen local features against their published form, batch norms and all."""

import torch
from safetensors.torch import save_file
from torch import nn
from torch.nn import functional as F

from langflash_core.network import MINI, initial_network
from langflash_core.network.checkpoints.files import adopt_frozen
from langflash_core.network.encoders.local import DIM, LocalFeatures, convert
from langflash_core.network.prior import resize

# (inputs, outputs, kernel, stride) per layer, as the paper's figure 3 has them
BLOCKS = {
    "block1": ((1, 4, 3, 1), (4, 8, 3, 2), (8, 8, 3, 1), (8, 24, 3, 2)),
    "block2": ((24, 24, 3, 1), (24, 24, 3, 1)),
    "block3": ((24, 64, 3, 2), (64, 64, 3, 1), (64, 64, 1, 1)),
    "block4": ((64, 64, 3, 2), (64, 64, 3, 1), (64, 64, 3, 1)),
    "block5": ((64, 128, 3, 2), (128, 128, 3, 1), (128, 128, 3, 1), (128, 64, 1, 1)),
    "block_fusion": ((64, 64, 3, 1), (64, 64, 3, 1)),
}


class Published(nn.Module):
    """Convolution, batch norm without affine part, ReLU; evaluated layer by layer."""

    def __init__(self):
        super().__init__()
        self.tensors: dict[str, torch.Tensor] = {}
        for block, layers in BLOCKS.items():
            for i, (inputs, outputs, kernel, _) in enumerate(layers):
                at = f"{block}.{i}.layer"
                self.tensors[f"{at}.0.weight"] = torch.randn(outputs, inputs, kernel, kernel) / (
                    3 * inputs**0.5
                )
                self.tensors[f"{at}.1.running_mean"] = 0.1 * torch.randn(outputs)
                self.tensors[f"{at}.1.running_var"] = 0.5 + torch.rand(outputs)
        self.tensors |= {
            "block_fusion.2.weight": torch.randn(64, 64, 1, 1),
            "block_fusion.2.bias": torch.randn(64),
        }
        self.tensors |= {"skip1.1.weight": torch.randn(24, 1, 1, 1), "skip1.1.bias": torch.randn(24)}
        self.tensors["heatmap_head.2.weight"] = torch.randn(1, 64, 1, 1)  # belongs to a head left out

    def run(self, block: str, x: torch.Tensor) -> torch.Tensor:
        t = self.tensors
        for i, (_, _, kernel, stride) in enumerate(BLOCKS[block]):
            at = f"{block}.{i}.layer"
            x = F.conv2d(x, t[f"{at}.0.weight"], stride=stride, padding=kernel // 2)
            x = F.relu(F.batch_norm(x, t[f"{at}.1.running_mean"], t[f"{at}.1.running_var"], eps=1e-5))
        return x

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        t = self.tensors
        grey = F.instance_norm(resize(images, (160, 224)).mean(1, keepdim=True))  # 3 x (56, 70), in 32s
        skip = F.conv2d(F.avg_pool2d(grey, 4), t["skip1.1.weight"], t["skip1.1.bias"])
        eighth = self.run("block3", self.run("block2", self.run("block1", grey) + skip))
        sixteenth = self.run("block4", eighth)
        coarse = self.run("block5", sixteenth)
        joined = eighth + resize(sixteenth, (20, 28)) + resize(coarse, (20, 28))
        last = F.conv2d(
            self.run("block_fusion", joined), t["block_fusion.2.weight"], t["block_fusion.2.bias"]
        )
        return F.normalize(last, dim=1)


def test_folded_norms_change_nothing():
    torch.manual_seed(0)
    published, own = Published(), LocalFeatures().eval()
    own.load_state_dict(convert(published.tensors))
    images = torch.rand(2, 3, 56, 70)
    found = own(images)
    assert found.shape == (2, DIM, 20, 28)
    torch.testing.assert_close(found, published(images), atol=1e-4, rtol=0)  # float32, 20 layers
    torch.testing.assert_close(own(0.5 * images), found, atol=1e-2, rtol=0)  # exposure is normalised away
    assert not any(p.requires_grad for p in own.parameters())


def test_a_blank_picture_gives_finite_descriptors():
    assert torch.isfinite(LocalFeatures().eval()(torch.full((1, 3, 56, 70), 0.5))).all()


def test_published_weights_become_a_file_to_start_from(untrained, tmp_path):
    torch.manual_seed(0)
    published = Published()
    save_file(published.tensors, tmp_path / "xfeat.safetensors")
    save_file(untrained.encoder.vit.state_dict(), tmp_path / "vit.safetensors")
    out = tmp_path / "start.safetensors"
    adopt_frozen(MINI, tmp_path / "vit.safetensors", tmp_path / "xfeat.safetensors", out)
    network = initial_network(MINI, out)
    images = torch.rand(1, 3, 56, 70)
    alike = F.cosine_similarity(network.local(images), published(images)).mean()
    assert alike > 0.99  # int8 rows
    key = "blocks.3.attn.qkv.bias"
    own, given = (n.encoder.vit.state_dict()[key] for n in (network, untrained))
    torch.testing.assert_close(own, given, rtol=1e-3, atol=1e-6)  # float16
