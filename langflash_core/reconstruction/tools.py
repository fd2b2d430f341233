"""The network of a reconstruction, and how it is used: what gives groups, their vectors and outlines."""

from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from langflash_core.base.detail import Detail, chosen_detail
from langflash_core.errors import InputError, WeightsError
from langflash_core.images.views import source_pictures
from langflash_core.language.clip import load_clip_images
from langflash_core.network import PRESETS, LangFlashNet, load_network
from langflash_core.network.build import network_class
from langflash_core.network.checkpoints.parts import part_folder
from langflash_core.network.checkpoints.stored import Stored
from langflash_core.network.model import Atoms, Geometry, Lifted, Redrawn, pooled_weights
from langflash_core.network.precision import bfloat16_fails, has_bfloat16
from langflash_core.network.presets import AGGREGATIONS, GROUPINGS, PRECISIONS
from langflash_core.network.semantics.aggregation import averaged_atoms
from langflash_core.network.semantics.crops import crop_atoms
from langflash_core.network.semantics.grouping import Groups
from langflash_core.network.semantics.lifting import lifted_weights
from langflash_core.network.semantics.outlines import Outlines
from langflash_core.network.semantics.sam2 import Sam2, sam2_checkpoint
from langflash_core.reconstruction.networks import Networks
from langflash_core.reconstruction.options import Options
from langflash_core.types import Views


@dataclass(frozen=True)
class Tools:
    """The network, and what stands in for parts of it; None: its own. finer: how finely its surfaces are
    covered; None: by the Gaussians that it makes."""

    network: LangFlashNet
    atoms: Atoms | None
    groups: Lifted | None
    redrawn: Redrawn | None
    finer: Detail | None


def open_tools(options: Options, views: Views, networks: Networks, stored: Future[Stored] | None) -> Tools:
    """Read what these options need.

    Args:
        stored: the checkpoint, where its file is being read already.

    Raises:
        InputError: a word is unknown, or the preset does not have what it names.
        WeightsError: there are no weights for it.
    """
    network = _network(options, networks, stored)
    return Tools(
        network,
        atoms=_atoms(network, options.aggregation, views),
        groups=_groups(network, options.grouping, options.device),
        redrawn=_redrawn(options.grouping, options.device),
        finer=None if options.detail is None or not network.surfaces else chosen_detail(options.detail),
    )


def _network(options: Options, networks: Networks, stored: Future[Stored] | None) -> LangFlashNet:
    """The network; a checkpoint that changed on disk is another one."""
    path = None if options.weights is None else Path(options.weights).resolve()
    changed = path.stat().st_mtime_ns if path is not None and path.is_file() else 0
    folder = part_folder(PRESETS[options.preset])
    installed = tuple((p.name, p.stat().st_mtime_ns) for p in sorted(folder.glob("*.safetensors")))
    mixed = _bfloat16(options.preset, options.precision, options.device)

    def read() -> LangFlashNet:
        found = None if stored is None else stored.result()
        return load_network(options.preset, path, options.device, bfloat16=mixed, stored=found)

    return networks.get((options.preset, path, options.device, mixed, changed, installed), read)


def _bfloat16(preset: str, precision: str, device: str) -> bool:
    if precision not in PRECISIONS:
        raise InputError(f"the precision '{precision}' is unknown; choose {', '.join(PRECISIONS)}")
    if precision == "bfloat16" and device == "cpu" and bfloat16_fails():
        raise InputError(
            "ATEN_CPU_CAPABILITY hides what this processor needs for bfloat16; "
            "take it out of the environment, or choose --precision float32"
        )
    if precision != "auto":
        return precision == "bfloat16"
    by_itself = device == "cpu" and network_class(PRESETS[preset]).bfloat16_on_cpu and has_bfloat16()
    return by_itself or device == "cuda"


def _atoms(network: LangFlashNet, way: str | None, views: Views) -> Atoms | None:
    """How groups get their vectors; None: as the network does it.

    Raises:
        InputError: an unknown way, or one that this preset does not have. WeightsError: no weights for it.
    """
    if way is None:
        return None
    if way == "average":
        return lambda weights, features: averaged_atoms(pooled_weights(weights, features), features)[0]
    if way == "lfa":
        if not network.aggregated:
            raise WeightsError("the aggregation has no weights here; choose --aggregation average or crops")
        return None
    if way != "crops":
        raise InputError(f"the aggregation '{way}' is unknown; choose {', '.join(AGGREGATIONS)}")
    if network.preset.space != "clip":
        raise InputError(
            f"crops are embedded by CLIP, but the preset '{network.preset.name}' speaks "
            f"'{network.preset.space}'; choose --aggregation lfa or average"
        )
    tower, photos = load_clip_images(), source_pictures(views)
    return lambda weights, _: crop_atoms(weights, photos, lambda p: tower.encode(p.cpu()).to(weights))


def _groups(network: LangFlashNet, way: str | None, device: str) -> Lifted | None:
    """Where groups come from; None: the network's own parts.

    Raises:
        InputError: an unknown way. WeightsError: no weights for it.
    """
    if way not in (None, *GROUPINGS):
        raise InputError(f"the grouping '{way}' is unknown; choose {', '.join(GROUPINGS)}")
    trained = way in ("queries", "mobile-sam")
    if trained and not network.grouped:
        raise WeightsError("the grouping has no weights here; `langflash weights get langflash` fetches them")
    if trained or (way is None and (network.grouped or sam2_checkpoint() is None)):
        return None
    oracle = Sam2(device)

    def lifted(geometry: Geometry, views: Views) -> Tensor:
        found = [oracle(photo) for photo in views.images]
        groups = [Groups(s.logits[None, None], s.scores.clamp(1e-6, 1 - 1e-6).logit()[None]) for s in found]
        return lifted_weights(groups, geometry, views.Ks)

    return lifted


def _redrawn(way: str | None, device: str) -> Redrawn | None:
    """What gives groups finer outlines; None: they stay as they are.

    Raises:
        WeightsError: no weights for it.
    """
    if way != "mobile-sam":
        return None
    outlines = Outlines.load_installed(device)
    return lambda weights, views: outlines(weights, source_pictures(views))
