"""Language that travels beside plain splats: weights, dictionary, views and names as one safetensors block.

A .ply gets it as a side-car, NAME.language.safetensors; a .glb carries it inside. Viewers read the
Gaussians and know nothing of it. Tensors: weight_ids and weight_values (N, m), dictionary (K, C),
viewmats (V, 4, 4), Ks (V, 3, 3), the photos, and where they are known view_ids, levels and confidences (N,);
the header's JSON says the language space, the size of the views, the scene's record, and the SHA-256 of the
Gaussians' positions: who moves, sorts or removes some in another program gets the plain splats and a
sentence, not words on the wrong things.
"""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import safetensors.torch
import torch
from safetensors import SafetensorError

from langflash_core.base.limits import ATOMS, VIEWS
from langflash_core.export.packing import error_line
from langflash_core.scene.checks import check_scene
from langflash_core.scene.container import in_order
from langflash_core.scene.fields import to_fields
from langflash_core.scene.record import from_json, to_json
from langflash_core.scene.weights import renormalise
from langflash_core.types import Gaussians, Scene, Semantics

SIDE_CAR = ".language.safetensors"
_FORMAT, _VERSION = "langflash-language", 1
_PLAIN = ("means", "quats", "scales", "opacities", "sh")  # fields that the splats themselves hold
_DAMAGE = (SafetensorError, ValueError, LookupError, TypeError, RuntimeError, ArithmeticError, RecursionError)


def side_car(path: Path) -> Path:
    """Where the language of a splat file lies: beside it, with the same stem."""
    return path.with_name(path.stem + SIDE_CAR)


def speaks(scene: Scene) -> bool:
    """Whether there is language to carry."""
    return scene.semantics.num_atoms > 0


def packed_language(scene: Scene) -> bytes:
    """The block of a scene with language."""
    fields = {name: values for name, values in to_fields(scene).items() if name not in _PLAIN}
    described = {
        "space": scene.semantics.space,
        "view_size": scene.view_size,
        "metadata": to_json(scene.record),
        "positions": _fingerprint(scene.gaussians),
    }
    header = {"format": _FORMAT, "version": str(_VERSION), "language": json.dumps(described, allow_nan=False)}
    return in_order(safetensors.torch.save(fields, header))


def with_language(scene: Scene, block: bytes, name: str) -> Scene:
    """Plain splats with the language of a block; as they are, with a warning, where it does not fit.

    Args:
        name: what to call the block in the warning.
    """
    try:
        fields, described = _unpack(block)
        if described["positions"] != _fingerprint(scene.gaussians):
            return _add_warning(
                scene, f"{name} belongs to other Gaussians than these; they were read without it."
            )
        names = sorted((f for f in fields if f.startswith("photo_")), key=lambda name: (len(name), name))
        photos = tuple(fields[photo].numpy().tobytes() for photo in names)
        for limit, part in ((ATOMS, "dictionary"), (VIEWS, "viewmats")):
            if limit.passed_by(len(fields[part])):
                raise ValueError(f"{len(fields[part]):,} {limit.name}; {limit.remedy()}")
        known = from_json(dict(described["metadata"]))
        width, height = (int(side) for side in described["view_size"])
        whole = replace(
            scene,
            semantics=Semantics(
                weight_ids=fields["weight_ids"].long(),
                weight_values=renormalise(fields["weight_values"].float()),
                dictionary=fields["dictionary"].float(),
                space=str(described["space"]),
            ),
            viewmats=fields["viewmats"].float(),
            Ks=fields["Ks"].float(),
            view_size=(width, height),
            photos=photos,
            view_ids=fields["view_ids"].long() if "view_ids" in fields else None,
            record=replace(known, antialiased=known.antialiased or scene.record.antialiased),
            levels=fields.get("levels"),
            confidences=fields["confidences"].float() / 255 if "confidences" in fields else None,
        )
        check_scene(whole)
        return whole
    except _DAMAGE as error:
        return _add_warning(
            scene, f"{name} is damaged ({error_line(error)}); the Gaussians were read without it."
        )


def _unpack(block: bytes) -> tuple[dict[str, torch.Tensor], dict]:
    """Tensors and the header's JSON."""
    length = int.from_bytes(block[:8], "little")
    header = json.loads(block[8 : 8 + length])["__metadata__"]
    if header["format"] != _FORMAT or header["version"] != str(_VERSION):
        raise ValueError(f"expected {_FORMAT} {_VERSION}, found {header['format']} {header['version']}")
    return safetensors.torch.load(block), json.loads(header["language"])


def _fingerprint(gaussians: Gaussians) -> str:
    means = gaussians.means.detach().cpu().float().contiguous().numpy()
    return hashlib.sha256((means + 0.0).astype("<f4").tobytes()).hexdigest()  # + 0.0: -0 becomes 0


def _add_warning(scene: Scene, sentence: str) -> Scene:
    return scene.with_record(warnings=(*scene.record.warnings, sentence))
