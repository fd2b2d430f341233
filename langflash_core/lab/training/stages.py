"""The stages of training: which modules learn, from what, and what is measured.

Each stage trains its own modules on frozen encoder tokens; what it reads from earlier stages is
frozen too. `geometry` stages are depth, refine, gaussians; `meaning` stages are language,
grouping, aggregation: the two chains do not read each other and can run side by side.

Sizes: B scenes, V views, H W pixels, h w the head's own size, N queries, G groups, C channels.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.grouping import (
    AggregationWeights,
    GroupingWeights,
    GroupTexts,
    aggregation_loss,
    grouping_loss,
    mask_quality,
)
from langflash_core.lab.training.losses import (
    depth_loss,
    error_loss,
    gradient_loss,
    instance_contrast,
    language_loss,
    log_residual,
    photometric_loss,
    point_loss,
)
from langflash_core.lab.training.shards import NOTHING, Label
from langflash_core.lab.training.student import Student
from langflash_core.lab.training.words import PhraseSampler
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.gaussians import assemble_gaussians
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.pointmaps import PointMapNet
from langflash_core.network.semantics.aggregation import average_atoms
from langflash_core.network.stereo.prior import DepthMaps, resize
from langflash_core.splat import rasterize, view_colours
from langflash_core.types import Camera

PIXELS_PER_PICTURE = 512
"""Pixels that the language stage draws from one picture, balanced over its instances."""
CONTRAST_PIXELS = 768
"""Pixels per scene that the grouping stage compares with each other."""
TOKEN_DROPOUT = 0.15
"""Share of token channels that the language stage hides in a picture."""
MIN_GROUP_PIXELS = 12
"""Instances with fewer pixels over all views (at the mask map's sampled size) are not groups."""
STUDENT = "student"
"""What the network calls the module that regresses SAM's embedding, while there is one."""
GAUSSIAN_STRIDE = 2
"""The Gaussian stage renders every second pixel; footprints are relative, so sizes carry over."""


@dataclass(frozen=True)
class Words:
    """What the meaning stages say: a sampler, and a generator that makes it repeatable."""

    sampler: PhraseSampler
    generator: torch.Generator


@dataclass(frozen=True)
class Loss:
    """total: scalar to minimise; parts: named numbers for the log."""

    total: Tensor
    parts: dict[str, float] = field(default_factory=dict)


StageLoss = Callable[[LangFlashNet, Any, Words], Loss]
"""Network, what the stage's set draws (a `SceneBatch`; for naming a `PartBatch`), words -> loss."""


@dataclass(frozen=True)
class Stage:
    """modules: attributes of the network that learn; needs: stages whose modules are read frozen;
    views: how many views a scene gives, with their chances; learning_rate: AdamW's peak; photos: share
    of the pictures that come from labelled photos, where some are cached; rates: what a module's rate is of
    the stage's, 1 where it is not named; dense: SAM's embedding of rooms is drawn with them."""

    name: str
    modules: tuple[str, ...]
    needs: tuple[str, ...]
    views: dict[int, float]
    pictures: int
    learning_rate: float
    loss: StageLoss
    photos: float = 0.0
    rates: Mapping[str, float] = field(default_factory=dict)
    dense: bool = False


def depth_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Monocular log depth and its expected error, from the decoder and the depth head."""
    maps = guided(network).monocular_depth(tokens_of(network, batch), batch.Ks)
    logs, errors, truth = (t.flatten(0, 1).float() for t in (maps.log_depths, maps.log_errors, batch.depths))
    shape, slope = depth_loss(logs, truth), gradient_loss(logs, truth)
    error = error_loss(logs, errors, truth)
    return Loss(shape + slope + 0.05 * error, _numbers(shape=shape, slope=slope, error=error))


def refine_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Plane-sweep refinement of the frozen prior, every pass of it, with the errors that poses will have."""
    network = guided(network)
    with torch.no_grad():
        prior = scaled_prior(network, batch)
        prior = replace(prior, log_depths=prior.log_depths + 0.05 * _noise(batch, (1, 1), words.generator))
        viewmats = perturbed_poses(batch.viewmats, words.generator, *_pose_noise(words.generator))
        local = network.local(batch.images.flatten(0, 1))
    passes = network.refiner(batch.images, tokens_of(network, batch), local, prior, viewmats, batch.Ks)
    truth = batch.depths.flatten(0, 1).float()
    total = truth.new_zeros(())
    for maps in passes:
        logs, errors = (t.flatten(0, 1).float() for t in (maps.log_depths, maps.log_errors))
        shape, slope = depth_loss(logs, truth, absolute=1.0), gradient_loss(logs, truth)
        error = error_loss(logs, errors, truth, shared_offset=False)
        total = total + (shape + slope + 0.05 * error) / len(passes)
    return Loss(total, _numbers(shape=shape, slope=slope, error=error))


def scaled_prior(network: LangFlashNet, batch: SceneBatch) -> DepthMaps:
    """The frozen prior brought to the poses' unit per view: median of log z* - log z.

    At run time matches tie the two; here the truth stands in for them.
    """
    prior = guided(network).monocular_depth(tokens_of(network, batch), batch.Ks)
    residuals, valid = log_residual(prior.log_depths.float(), batch.depths)
    shift = (
        torch.where(valid, -residuals, torch.full_like(residuals, torch.nan)).flatten(2).nanmedian(-1).values
    )
    return DepthMaps(
        prior.log_depths.float() + shift.nan_to_num(0)[..., None, None], prior.log_errors.float()
    )


POSE_NOISE = ((0.2, 0.02, 0.6), (0.8, 0.08, 0.3), (4.0, 0.4, 0.1))
"""(degrees, share of the baseline, chance): how wrong poses are at run time; mostly little."""


def _pose_noise(generator: torch.Generator) -> tuple[float, float]:
    """Degrees and share for one batch."""
    chances = torch.tensor([chance for _, _, chance in POSE_NOISE])
    degrees, share, _ = POSE_NOISE[int(torch.multinomial(chances, 1, generator=generator))]
    return degrees, share


def perturbed_poses(viewmats: Tensor, generator: torch.Generator, degrees: float, share: float) -> Tensor:
    """Poses (B, V, 4, 4) with rotations off by about `degrees`, translations by `share` of their length."""
    shape = viewmats.shape[:2]
    turn = (
        torch.randn(*shape, 3, generator=generator).to(viewmats) * torch.deg2rad(torch.tensor(degrees)).item()
    )
    cross = torch.zeros(*shape, 3, 3).to(viewmats)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -turn[..., 2], turn[..., 1], -turn[..., 0]
    rotation = torch.matrix_exp(cross - cross.transpose(-1, -2))
    shift = torch.randn(*shape, 3, generator=generator).to(viewmats)
    moved = viewmats.clone()
    moved[..., :3, :3] = rotation @ viewmats[..., :3, :3]
    lengths = viewmats[..., :3, 3].norm(dim=-1, keepdim=True)
    moved[..., :3, 3] = viewmats[..., :3, 3] + share * lengths * shift
    moved[:, 0] = viewmats[:, 0]
    return moved


def gaussians_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Photometric loss of the last view rendered from the Gaussians of the views before it."""
    totals, psnrs = [], []
    rendered = novel_views(network, batch)
    for picture, alphas, photo in rendered:
        totals.append(photometric_loss(picture, photo, torch.ones_like(alphas, dtype=torch.bool)))
        psnrs.append(float(-10 * torch.log10(F.mse_loss(picture.detach().clamp(0, 1), photo) + 1e-10)))
    total = torch.stack(totals).mean()
    return Loss(total, {"psnr": sum(psnrs) / len(psnrs)})


def novel_views(network: LangFlashNet, batch: SceneBatch) -> list[tuple[Tensor, Tensor, Tensor]]:
    """Per scene: the last view rendered from the others, its alphas, and the photo, at half size.

    A scene of two views renders view 1 from view 0 alone. Pixels that no Gaussian covers show the
    photo's mean colour, so that holes cost little and opacity is not pushed up to fill them.
    """
    network = guided(network)
    context = _views(batch, range(batch.images.shape[1] - 1))
    with torch.no_grad():
        maps = network.refiner(
            context.images,
            tokens_of(network, context),
            network.local(context.images.flatten(0, 1)),
            scaled_prior(network, context),
            context.viewmats,
            context.Ks,
        )[-1]
        levels = network.levels(tokens_of(network, context), context.Ks)
    raw = network.gaussian_head(levels, context.images)
    size = (batch.size[0] // GAUSSIAN_STRIDE, batch.size[1] // GAUSSIAN_STRIDE)
    ratio = torch.tensor([1 / GAUSSIAN_STRIDE, 1 / GAUSSIAN_STRIDE, 1.0]).to(batch.Ks)[:, None]
    scenes = []
    for i in range(batch.images.shape[0]):
        small = DepthMaps(_shrink(maps.log_depths[i], size), _shrink(maps.log_errors[i], size))
        pictures = resize(context.images[i], size)
        gaussians = assemble_gaussians(
            resize(raw[i].float(), size), pictures, small, context.viewmats[i], context.Ks[i] * ratio
        )
        camera = Camera(batch.viewmats[i, -1], batch.Ks[i, -1] * ratio, size[1], size[0])
        photo = resize(batch.images[i, -1:], size)[0].permute(1, 2, 0)
        rgb, alphas = rasterize(gaussians, view_colours(gaussians, camera), camera)
        scenes.append((rgb + (1 - alphas[..., None]) * photo.mean((0, 1)), alphas, photo))
    return scenes


def language_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """L(x) against the sampled phrase of each pixel's instance; pixels are drawn class-balanced.

    The last layer runs on the drawn pixels only: it is per pixel, so
    nothing changes. Channels of the tokens are dropped, so that the head names things by more
    than what gives away one piece of furniture.
    """
    head = guided(network).language_head
    tokens = thinned(tokens_of(network, batch), TOKEN_DROPOUT, words.generator)
    hidden = head.hidden(tokens)  # (B*V, F, h, w)
    scenes = [words.sampler.draw(labels, words.generator) for labels in batch.labels]
    bank = phrase_bank(torch.cat(scenes), words)
    features, rows, true = [], [], []
    for b, labels in enumerate(batch.labels):
        holds = words.sampler.true(labels)[:, bank]
        for v in range(batch.images.shape[1]):
            ids = nearest(batch.instances[b, v], (hidden.shape[-2], hidden.shape[-1]))
            chosen = balanced_pixels(ids, words.sampler.balance(labels), PIXELS_PER_PICTURE, words.generator)
            flat = hidden[b * batch.images.shape[1] + v].flatten(1).T
            features.append(flat[chosen])
            named = ids.flatten()[chosen].cpu()
            rows.append(scenes[b][named])
            true.append(holds[named])
    last = head.out
    vectors = F.linear(torch.cat(features), last.weight[:, :, 0, 0], last.bias)
    texts = words.sampler.table.embeddings.to(vectors.device)
    targets = texts[torch.cat(rows).to(vectors.device)]
    total = language_loss(
        vectors, targets, texts[bank.to(vectors.device)], true=torch.cat(true).to(vectors.device)
    )
    cosine = F.cosine_similarity(vectors.detach().float(), targets, dim=-1)
    return Loss(total, _numbers(cosine=cosine.mean()))


def thinned(tokens: Tokens, share: float, generator: torch.Generator) -> Tokens:
    """Tokens with `share` of each view's channels set to 0 and the rest scaled up, hook by hook."""

    def thin(hook: Tensor) -> Tensor:
        kept = torch.rand(*hook.shape[:2], 1, hook.shape[-1], generator=generator) >= share
        return hook * (kept.to(hook) / (1 - share))

    return tokens.each(thin)


def phrase_bank(used: Tensor, words: Words, extra: int = 128) -> Tensor:
    """Rows (A,) of negatives: the batch's phrases, every class group and baseline, some random phrases."""
    table = words.sampler.table
    random = torch.randint(len(table.phrases), (extra,), generator=words.generator)
    return torch.cat((used.cpu(), table.standing_rows(), random)).unique()


def balanced_pixels(ids: Tensor, weights: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """Flat indices (count,) of pixels of an instance map (h, w), drawn with chance
    weights[instance] / sqrt(its area); fewer instances' pixels may repeat; empty if nothing is labelled."""
    flat = ids.flatten().cpu()
    labelled = (flat < len(weights)).nonzero().squeeze(-1)
    if len(labelled) == 0:
        return labelled.to(ids.device)
    areas = torch.bincount(flat[labelled], minlength=len(weights)).float()
    chance = (weights * areas.clamp_min(1).rsqrt())[flat[labelled]]
    drawn = torch.multinomial(chance, count, replacement=True, generator=generator)
    return labelled[drawn].to(ids.device)


def evenly_drawn(rows: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """Indices of at most `count` entries of `rows` (P,) on the CPU that are not negative, drawn again and
    again with chance 1 / sqrt(how many bear the same number); empty if none is."""
    chosen = (rows >= 0).nonzero()[:, 0]
    if not len(chosen):
        return chosen
    chance = torch.bincount(rows[chosen]).float()[rows[chosen]].rsqrt()
    return chosen[torch.multinomial(chance, min(count, len(chosen)), True, generator=generator)]


def nearest(ids: Tensor, size: tuple[int, int]) -> Tensor:
    """An instance map (..., H, W) at another size, by the nearest pixel centre; never mixes ids."""
    height, width = ids.shape[-2:]
    ys = ((torch.arange(size[0], device=ids.device) + 0.5) * height / size[0]).long()
    xs = ((torch.arange(size[1], device=ids.device) + 0.5) * width / size[1]).long()
    return ids[..., ys[:, None], xs]


def grouping_stage(
    network: LangFlashNet, batch: SceneBatch, words: Words, weights: GroupingWeights | None = None
) -> Loss:
    """L_SG after every scale of the decoder, on every second pixel of the mask map; of photos that are
    labelled in part, on the pixels that are.

    On the map that masks are read from come `instance_contrast` and, where the weights ask for it and the
    batch holds it, the regression of SAM's embedding.
    """
    weights = weights or GroupingWeights()
    memories, finest = network.semantic_maps(frozen_tokens(network, batch), batch.images)
    offset_y, offset_x = torch.randint(2, (2,), generator=words.generator).tolist()
    size = (finest.shape[-2], finest.shape[-1])
    sampled = finest[..., offset_y::2, offset_x::2]
    answers = network.grouping(memories, sampled, batch.images.shape[1])
    ids = nearest(batch.instances, size)[..., offset_y::2, offset_x::2]
    masks = [group_masks(i)[0] for i in ids]
    maps = sampled.unflatten(0, batch.images.shape[:2])  # (B, V, f, h, w)
    contrast = torch.stack([_contrast(m, i, words) for m, i in zip(maps, ids, strict=True)]).mean()
    losses, quality = [], []
    for answer in answers:
        flat = answer.mask_logits.transpose(1, 2).flatten(2)  # (B, N, V*h*w)
        for logits, existence, truth, own in zip(flat, answer.existence_logits, masks, ids, strict=True):
            if batch.partly:
                seen = (own != NOTHING).flatten()
                logits, truth = logits[:, seen], truth[:, seen]
            loss, chosen = grouping_loss(logits, existence, truth, weights)
            losses.append(loss)
            if answer is answers[-1] and len(chosen.queries):
                quality.append(float(mask_quality(logits[chosen.queries], truth[chosen.groups]).mean()))
    total = torch.stack(losses).mean() + weights.mse * contrast
    told = {"soft_iou": sum(quality) / max(len(quality), 1), **_numbers(contrast=contrast)}
    if weights.teacher and batch.dense is not None:
        regressed = student_of(network).loss(finest, batch.dense)
        total, told = total + weights.teacher * regressed, told | _numbers(teacher=regressed)
    return Loss(total, told)


def student_of(network: LangFlashNet) -> Student:
    """What turns the network's finest map into SAM's embedding while it trains."""
    student = getattr(network, STUDENT, None)
    assert isinstance(student, Student), "training attaches it where a stage wants it"
    return student


def taught(stage: Stage, network: LangFlashNet) -> Stage:
    """The stage with a student of SAM's embedding, which the network has from here on, where it wants one."""
    if not stage.dense:
        return stage
    if not hasattr(network, STUDENT):
        setattr(network, STUDENT, Student(network.preset.dpt_feature))
    return replace(stage, modules=(*stage.modules, STUDENT))


def untaught(network: LangFlashNet) -> None:
    """Take the student away: nobody reads it after training."""
    if hasattr(network, STUDENT):
        delattr(network, STUDENT)


def _contrast(maps: Tensor, ids: Tensor, words: Words) -> Tensor:
    """`instance_contrast` on pixels of one scene's maps (V, f, h, w), balanced over instances (V, h, w)."""
    weights = torch.ones(NOTHING, device="cpu")
    chosen = balanced_pixels(ids, weights, CONTRAST_PIXELS, words.generator)
    flat = maps.permute(0, 2, 3, 1).flatten(0, 2)
    return instance_contrast(flat[chosen], ids.flatten()[chosen])


def group_masks(ids: Tensor) -> tuple[Tensor, Tensor]:
    """Masks (G, V*h*w) of 0 and 1 and instance ids (G,) of one scene's instance maps (V, h, w).

    An instance is one group over all views; those under `MIN_GROUP_PIXELS` are left to nobody.
    """
    flat = ids.flatten()
    counts = torch.bincount(flat, minlength=NOTHING + 1)[:NOTHING]
    kept = (counts >= MIN_GROUP_PIXELS).nonzero().squeeze(-1)
    return (flat[None] == kept[:, None]).float(), kept


def aggregation_stage(
    network: LangFlashNet, batch: SceneBatch, words: Words, weights: AggregationWeights | None = None
) -> Loss:
    """L_LFA over the parts that the frozen grouping finds; a part is called what most of it shows."""
    losses, cosines = [], []
    for i in range(batch.images.shape[0]):
        found = named_parts(network, one_scene(batch, i))
        if found is None:
            continue
        collected = batch.vectors[i] if batch.vectors else None
        if collected is None:
            texts = _named_texts(found, batch.labels[i], words)
        else:  # of things without a name: all others of the scene are what they are not
            texts = collected_texts(collected.to(found.atoms), found, network.preset.space)
        chosen = weights or AggregationWeights()
        losses.append(aggregation_loss(found.atoms, found.pooled, found.quality, texts, chosen))
        cosines.append(float(F.cosine_similarity(found.atoms.detach(), texts.truth, dim=-1).mean()))
    if not losses:
        return Loss(sum(p.sum() for p in network.aggregation.parameters()) * torch.zeros(()), {"cosine": 0.0})
    return Loss(torch.stack(losses).mean(), {"cosine": sum(cosines) / len(cosines)})


def collected_texts(vectors: Tensor, found: "NamedParts", space: str) -> GroupTexts:
    """The vectors (N, C) of the instances that parts are, and all of the scene for a bank.

    Raises:
        InputError: they are not of the network's space.
    """
    channels = found.atoms.shape[1]
    if vectors.shape[1] != channels:
        raise InputError(
            f"collected vectors have {vectors.shape[1]} numbers, those of the network {channels}; collect "
            f"them again, with langflash labels --vectors {space}"
        )
    return GroupTexts(vectors[found.instances], vectors)


def _named_texts(found: "NamedParts", labels: Sequence[Label], words: Words) -> GroupTexts:
    """A phrase of each part's label, and a bank of which some are true of it, too."""
    instances = found.instances.cpu()
    phrases = words.sampler.draw(labels, words.generator)[instances]
    bank, embeddings = phrase_bank(phrases, words), words.sampler.table.embeddings
    return GroupTexts(
        embeddings[phrases].to(found.atoms),
        embeddings[bank].to(found.atoms),
        words.sampler.true(labels)[instances][:, bank].to(found.atoms.device),
    )


@dataclass(frozen=True)
class NamedParts:
    """M parts of a scene that show something labelled: atoms and pooled (M, C), instances (M,), and
    quality (M,), the share of a part that is its instance."""

    atoms: Tensor
    pooled: Tensor
    quality: Tensor
    instances: Tensor


def named_parts(network: LangFlashNet, batch: SceneBatch) -> NamedParts | None:
    """The atoms of one scene (B = 1) made as at run time, and the instance each mostly covers."""
    with torch.no_grad():
        tokens = tokens_of(network, batch)
        features = None if batch.frozen is None else batch.frozen.features
        if features is None:
            features = network.language(tokens, batch.images).float()
        size = (features.shape[-2], features.shape[-1])
        weights = network.parts(tokens, batch.images, size, features)[None]
        masks, instances = group_masks(nearest(batch.instances[0], size))  # (G, V*h*w), (G,)
        if weights.shape[2] == 0 or len(instances) == 0:
            return None
        quality, majority = mostly(weights[0], masks, network.preset.eps)
        named = quality > 0
        pooled = average_atoms(weights, features, network.preset.eps)[0]
    atoms = network.aggregation(weights, features)[0]
    return NamedParts(
        atoms[named], F.normalize(pooled[named], dim=-1), quality[named], instances[majority[named]]
    )


def mostly(weights: Tensor, masks: Tensor, eps: float) -> tuple[Tensor, Tensor]:
    """Of each part, (K,), the share that lies on the group it covers most, and that group's row.

    Args:
        weights: w_k(x), (V, K, h, w). masks: (G, V*h*w) of 0 and 1, G >= 1.
    """
    overlap, majority = (weights.transpose(0, 1).flatten(1).float() @ masks.T).max(1)
    return overlap / (weights.sum((0, 2, 3)) + eps), majority


def tokens_of(network: LangFlashNet, batch: SceneBatch) -> Tokens:
    """Tokens of a batch, also what the late half says, which no cache holds: it learns."""
    if not network.caches_tokens:  # but `frozen` keeps them while nothing before them learns
        return network.encode(batch.images, batch.Ks) if batch.frozen is None else batch.frozen.tokens
    if batch.tokens is not None and batch.tokens.named:
        return batch.tokens
    with torch.no_grad():
        return network.encode(batch.images, batch.Ks)


def frozen_tokens(network: LangFlashNet, batch: SceneBatch) -> Tokens:
    """The cached tokens of the frozen encoder alone, where there are any: for stages that name nothing."""
    cached = batch.tokens if network.caches_tokens else None
    return tokens_of(network, batch) if cached is None else cached


def guided(network: LangFlashNet) -> GuidedDepthNet:
    """The network, for stages that only guided depth has.

    Raises:
        InputError: it predicts point maps.
    """
    if not isinstance(network, GuidedDepthNet):
        raise InputError(
            f"the preset '{network.preset.name}' has no such stage; train {', '.join(POINT_STAGES)} instead"
        )
    return network


def pointed(network: LangFlashNet) -> PointMapNet:
    """The network, for stages that only point maps have.

    Raises:
        InputError: it predicts depth.
    """
    if not isinstance(network, PointMapNet):
        raise InputError(
            f"the preset '{network.preset.name}' predicts depth, not point maps; train depth and refine"
        )
    return network


def modules_of(network: LangFlashNet, stage: Stage) -> tuple[str, ...]:
    """Those of the stage's modules that this kind of network has."""
    return tuple(name for name in stage.modules if hasattr(network, name))


def points_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Point maps of all views in view 0's frame; one unit of length per scene, as no photo tells more."""
    points = pointed(network).point_maps(tokens_of(network, batch), batch.images).float()
    poses = invert_rigid(batch.viewmats)
    pos_c = unproject(batch.depths, batch.Ks)
    truth = torch.einsum("bvij,bvhwj->bvhwi", poses[..., :3, :3], pos_c) + poses[..., None, None, :3, 3]
    loss = point_loss(points.movedim(2, -1), truth, batch.depths > 0)
    return Loss(loss, _numbers(points=loss))


def _noise(batch: SceneBatch, size: tuple[int, int], generator: torch.Generator) -> Tensor:
    return torch.randn(*batch.images.shape[:2], *size, generator=generator).to(batch.images)


def _shrink(maps: Tensor, size: tuple[int, int]) -> Tensor:
    """(V, H, W) maps at a smaller size, by the nearest centre: averaged depths would invent surfaces."""
    return F.interpolate(maps[:, None], size=size, mode="nearest-exact")[:, 0]


def _views(batch: SceneBatch, chosen) -> SceneBatch:
    """The batch with only some views."""
    keep = list(chosen)
    tokens = None if batch.tokens is None else batch.tokens.views(keep)
    return SceneBatch(
        batch.images[:, keep], batch.depths[:, keep], batch.instances[:, keep],
        batch.viewmats[:, keep], batch.Ks[:, keep], tokens, batch.labels, batch.seeds, batch.partly,
    )  # fmt: skip


def _numbers(**parts: Tensor) -> dict[str, float]:
    return {name: float(value.detach()) for name, value in parts.items()}


def one_scene(batch: SceneBatch, index: int) -> SceneBatch:
    """One scene of a batch, B = 1."""
    one = slice(index, index + 1)
    tokens = None if batch.tokens is None else batch.tokens.scene(index)
    return SceneBatch(
        batch.images[one], batch.depths[one], batch.instances[one], batch.viewmats[one], batch.Ks[one],
        tokens, batch.labels[one], batch.seeds[one], batch.partly,
        None if batch.dense is None else batch.dense[one], batch.vectors[one],
        None if batch.frozen is None else batch.frozen.scene(index),
    )  # fmt: skip


STAGES = {
    stage.name: stage
    for stage in (
        Stage(
            "depth",
            ("decoder", "depth_head"),
            (),
            {1: 0.2, 2: 0.65, 3: 0.15},
            8,
            5e-4,
            depth_stage,
            photos=0.6,
        ),
        Stage("refine", ("refiner",), ("depth",), {2: 0.8, 3: 0.2}, 8, 1e-3, refine_stage),
        Stage("gaussians", ("gaussian_head",), ("depth", "refine"), {3: 1.0}, 6, 5e-4, gaussians_stage),
        Stage("language", ("language_head",), (), {1: 1.0}, 12, 1e-3, language_stage),
        Stage(
            "grouping",
            ("siamese", "scratch", "grouping"),
            (),
            {2: 0.8, 3: 0.2},
            8,
            5e-4,
            grouping_stage,
            photos=0.5,
        ),
        Stage(
            "aggregation",
            ("aggregation",),
            ("language", "grouping"),
            {2: 0.8, 3: 0.2},
            8,
            3e-4,
            aggregation_stage,
            photos=0.5,
        ),
    )
}
"""What `mini` trains; `full` trains `POINT_STAGES`, of which grouping and aggregation are the same."""

POINT_STAGES = {
    "points": Stage("points", ("decoder", "point_heads"), (), {2: 0.8, 3: 0.2}, 8, 2e-4, points_stage),
    "grouping": replace(STAGES["grouping"], needs=("points",), learning_rate=2e-4),
    "aggregation": replace(STAGES["aggregation"], needs=("grouping",), learning_rate=2e-4),
}
