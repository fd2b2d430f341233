"""Owner of one trap: torchvision's compiled operators next to a CPU-only torch.

timm and open_clip import torchvision, whose Python side registers shape rules for operators
that its compiled side may not have brought along; the import then fails with
"operator torchvision::nms does not exist". LangFlash calls none of those operators, so it is
enough to declare them. Call `ensure_torchvision()` before the first import of timm or open_clip.
"""

import importlib
import sys
from functools import lru_cache

import torch

_SIGNATURE = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"


@lru_cache(maxsize=1)
def ensure_torchvision() -> torch.library.Library | None:
    """Make `import torchvision` work; harmless where it already does.

    Returns:
        The operator library that holds the missing declarations (the cache keeps it alive, as
        they vanish with it), or None where nothing was missing.

    Raises:
        ImportError: torchvision is not installed.
        RuntimeError: torchvision fails for another reason.
    """
    try:
        importlib.import_module("torchvision")
        return None
    except RuntimeError as error:
        if "operator torchvision::" not in str(error):
            raise
    for name in [name for name in sys.modules if name.partition(".")[0] == "torchvision"]:
        del sys.modules[name]
    library = torch.library.Library("torchvision", "FRAGMENT")
    for name in ("nms", "qnms"):
        library.define(name + _SIGNATURE)
    importlib.import_module("torchvision")
    return library
