"""What crosses from one stage to the next: frozen dataclasses, and every convention.

Axes      OpenCV cameras: +x right, +y down, +z forward. World = camera of view 0.
Poses     `viewmats` (V, 4, 4) map world to camera: pos_c = R pos_w + t.
Pixels    `Ks` (V, 3, 3) in pixels; the centre of the top-left pixel is (0.5, 0.5).
Rotations quaternions wxyz, unit.
Values    bare names are activated: scales > 0 (standard deviations, scene units),
          opacities in [0, 1]. Stored forms say so: `log_scales`, `logit_opacities`.
Colour    the photo's sRGB values in [0, 1], no gamma change; colour = 0.5 + SH, clamped at 0.
Lengths   scene units: the mean distance of view 0's points is 1. `metric_scale`, when
          known, is metres per scene unit.
Sizes     B batch, V views, N Gaussians, K atoms, C channels, S spherical-harmonic bases,
          m weights kept per Gaussian, P prompts, H W pixels.
Tensors   float32, on one device, unless a docstring says otherwise.
"""

from dataclasses import dataclass, field, replace

import torch
from torch import Tensor


@dataclass(frozen=True)
class Camera:
    """One pinhole camera: `viewmat` (4, 4), `K` (3, 3) pixels, image size in pixels."""

    viewmat: Tensor
    K: Tensor
    width: int
    height: int

    def resized(self, width: int, height: int) -> "Camera":
        """The same camera drawn at another size; the field of view is kept per axis."""
        ratio = torch.tensor([width / self.width, height / self.height, 1.0]).to(self.K)
        return Camera(self.viewmat, self.K * ratio[:, None], width, height)


@dataclass(frozen=True)
class Views:
    """Photos as the network sees them, all of one size.

    images: (V, 3, H, W) in [0, 1]. Ks: (V, 3, 3) pixels of these images, after crop and
    resize. names: file names for people. sources: the photos as small JPEG bytes, the same
    crop. warnings: triage, one sentence each. viewmats: (V, 4, 4), world = view 0, in any unit, where
    poses are given instead of sought.
    """

    images: Tensor
    Ks: Tensor
    names: tuple[str, ...]
    sources: tuple[bytes, ...] = ()
    warnings: tuple[str, ...] = ()
    viewmats: Tensor | None = None

    @property
    def num_views(self) -> int:
        return self.images.shape[0]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.images.shape[-1], self.images.shape[-2]


@dataclass(frozen=True)
class Gaussians:
    """N anisotropic Gaussians in world space.

    means (N, 3); quats (N, 4) wxyz unit; scales (N, 3) > 0; opacities (N,) in [0, 1];
    sh (N, S, 3) spherical-harmonic coefficients, S in {1, 4, 9, 16, 25}.
    """

    means: Tensor
    quats: Tensor
    scales: Tensor
    opacities: Tensor
    sh: Tensor

    def __len__(self) -> int:
        return self.means.shape[0]

    def map(self, change) -> "Gaussians":
        """Apply `change: Tensor -> Tensor` to every field (indexing, casting, moving)."""
        return Gaussians(*(change(v) for v in (self.means, self.quats, self.scales, self.opacities, self.sh)))


NO_LANGUAGE = "none"  # the `space` of scenes that come from splat files


@dataclass(frozen=True)
class Semantics:
    """Sparse weights over a global dictionary: f_i = sum_j weight_values[i, j] d_{weight_ids[i, j]}.

    weight_ids (N, m) int64 in [0, K); weight_values (N, m) >= 0, rows sum to 1 (or 0 where a
    Gaussian carries nothing); dictionary (K, C), rows of unit norm; space: name of the
    language space the dictionary lives in ("minilm", "clip"; "none" where there is no language).
    """

    weight_ids: Tensor
    weight_values: Tensor
    dictionary: Tensor
    space: str

    @property
    def num_atoms(self) -> int:
        return self.dictionary.shape[0]

    def dense_weights(self) -> Tensor:
        """w_ik as a dense (N, K) matrix; repeated ids add up."""
        dense = self.weight_values.new_zeros(self.weight_ids.shape[0], self.num_atoms)
        if self.num_atoms == 0:
            return dense
        return dense.scatter_add(1, self.weight_ids, self.weight_values)


@dataclass(frozen=True)
class Prediction:
    """What a network hands over, whatever its geometry: everything per pixel, view by view.

    gaussians: N = V*H*W of them, order (v h w), world = view 0, network length units.
    weights: (V, K, H, W) softmax over the K surviving groups (K may be 0).
    dictionary: (K, C) unit rows. viewmats (V, 4, 4). depths (V, H, W), z, same unit.
    confidences (V, H, W) in [0, 1]. unplaced: views whose pose is not known (view 0's stands in).
    timings: seconds per stage, in order.
    """

    gaussians: Gaussians
    weights: Tensor
    dictionary: Tensor
    space: str
    viewmats: Tensor
    depths: Tensor
    confidences: Tensor
    unplaced: tuple[int, ...] = ()
    warnings: tuple[str, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Scene:
    """A finished scene: what is saved, splatted, queried, and exported.

    viewmats (V, 4, 4) and Ks (V, 3, 3) describe the input views at `view_size` (width, height).
    A scene from a splat file has no photos: its one view frames it, and its world is the file's.
    photos: small JPEG bytes per view. metadata: plain JSON values (preset, timings, counts,
    warnings, photo names, `metric_scale`).
    """

    gaussians: Gaussians
    semantics: Semantics
    viewmats: Tensor
    Ks: Tensor
    view_size: tuple[int, int]
    photos: tuple[bytes, ...] = ()
    metadata: dict = field(default_factory=dict)

    @property
    def num_views(self) -> int:
        return self.viewmats.shape[0]

    def camera(self, view: int, width: int | None = None, height: int | None = None) -> Camera:
        """Camera of input view `view` (from 0), optionally drawn at another size."""
        own = Camera(self.viewmats[view], self.Ks[view], *self.view_size)
        return own if width is None or height is None else own.resized(width, height)

    def with_metadata(self, **changes) -> "Scene":
        return replace(self, metadata={**self.metadata, **changes})


@dataclass(frozen=True)
class Frame:
    """One rendered view.

    rgb (H, W, 3), unclamped above, over `background`; alphas (H, W) = 1 - T;
    depths (H, W) = sum_i T_i a_i z_i / alpha, 0 where alpha < 1/255;
    weight_maps (H, W, K) = sum_i T_i a_i w_ik, or None when not asked for.
    """

    rgb: Tensor
    alphas: Tensor
    depths: Tensor
    weight_maps: Tensor | None = None


@dataclass(frozen=True)
class PromptAnswer:
    """One phrase answered in one view; the fields of `query --json` (blueprint section 7).

    score: the value compared with `threshold` to decide `found`. area: fraction of pixels in
    the mask. centroid, box (center, axes (3, 3) rows, size): scene units, None when not found.
    """

    prompt: str
    found: bool
    score: float
    threshold: float
    area: float
    centroid: tuple[float, float, float] | None
    box: dict | None


@dataclass(frozen=True)
class QueryResult:
    """P prompts in one view.

    relevance (P, H, W): cosine in [-1, 1] or relevancy in (0, 1), as `mode` says; 0 where the
    view is empty. masks (P, H, W) bool. frame: the view they belong to.
    """

    answers: tuple[PromptAnswer, ...]
    mode: str
    relevance: Tensor
    masks: Tensor
    frame: Frame
    camera: Camera
