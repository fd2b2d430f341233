"""Groups and dictionary of views whose geometry is known: no poses are sought, no depth is predicted."""

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.network.model import LangFlashNet, Seen
from langflash_core.types import Views


@torch.inference_mode()
def posed_semantics(
    network: LangFlashNet, views: Views, viewmats: Float[Tensor, "V 4 4"], depths: Float[Tensor, "V H W"]
) -> tuple[Float[Tensor, "V K H W"], Float[Tensor, "K C"]]:
    """What a network sees in V views, beside their own geometry.

    Args:
        views: of one size, sides multiples of the patch. viewmats: (V, 4, 4), world = view 0.
        depths: (V, H, W), z in the unit of `viewmats`, 0 where nothing is seen.

    Returns:
        w_k(x), (V, K, H, W), sums to 1 over K; dictionary (K, C), unit rows. On the CPU.
    """
    device = next(network.parameters()).device
    images, Ks = views.images[None].to(device), views.Ks[None].to(device)
    tokens = network.encode(images, Ks)
    features = network.language(tokens, images)
    size = (images.shape[-2], images.shape[-1])
    weights = network.parts(tokens, images, size, features)
    seen = Seen(images[0], tokens, depths.to(device), viewmats.to(device), Ks[0], views.sources)
    dictionary = network.dictionary(weights, features, seen)
    return weights.float().cpu(), dictionary.float().cpu()
