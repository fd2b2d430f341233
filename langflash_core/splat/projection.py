"""From 3D Gaussians to their footprints on an image, front to back.

A Gaussian (mu, Sigma) seen by a camera (R, t, K) becomes a 2D Gaussian around the projection
of mu, with covariance S = J R Sigma R^T J^T + 0.3 I in pixels^2. J is the Jacobian of the
pinhole projection at mu, its direction clamped to 1.3 times the field of view. An orthographic
projection is linear: its J is diag(fx, fy) without the column of z, and S is exact. With the
half matrix A = J R Q diag(s) (2, 3), S = A A^T + e I, and Cauchy-Binet gives

    det S = sum of the squared 2x2 minors of A + e tr(A A^T) + e^2,

a sum of positive terms: needles and discs of any aspect lose no digits to cancellation.
The lower Cholesky factor L of S whitens offsets: power = |L^-1 d|^2 / 2.

Source: Zwicker et al. 2001 (EWA), Kerbl et al. 2023 (constants), gsplat (off-centre clamp).
"""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.geometry.cameras import transform
from langflash_core.geometry.harmonics import sh_to_signal
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.types import Camera, Gaussians, Scene

# Scene units, and the mean distance of a normalised scene is 1. Nearer than a hundredth of it nothing
# is drawn, as in gsplat: what is there touches the eye, and the linearised projection fails.
NEAR = 0.01
DILATION = 0.3  # pixels^2 added to both axes: a footprint is never thinner than a pixel
TAN_MARGIN = 0.3  # the Jacobian's direction may leave the image by this share of its half size
ALPHA_MAX = 0.99
ALPHA_MIN = 1.0 / 255.0


@dataclass(frozen=True)
class Footprints:
    """n Gaussians that may touch the image, nearest first; equal depths keep their order.

    ids (n,) rows of the Gaussians given; centres (n, 2) pixels; roots (n, 3) the Cholesky
    factor (l11, l21, l22) of the footprint covariance, pixels; opacities (n,); depths (n,) z,
    scene units; num_dropped: Gaussians refused because a value was NaN or infinite.
    """

    ids: Int[Tensor, " n"]
    centres: Float[Tensor, "n 2"]
    roots: Float[Tensor, "n 3"]
    opacities: Float[Tensor, " n"]
    depths: Float[Tensor, " n"]
    num_dropped: int

    def boxes(self) -> Int[Tensor, "n 4"]:
        """Pixels that may pass the alpha cut: (n, 4) as x0, y0, x1, y1, half open, not clipped.

        alpha >= 1/255 means |L^-1 d| <= sqrt(2 ln(255 o)), an ellipse whose half extents are
        that radius times sqrt(S_xx) and sqrt(S_yy).
        """
        with torch.no_grad():
            radii = (2 * (self.opacities / ALPHA_MIN).clamp_min(1).log()).sqrt()
            half = torch.stack((self.roots[:, 0], self.roots[:, 1:].norm(dim=-1)), -1) * radii[:, None]
            limit = 1e9  # keeps the largest footprints inside int64 and float32
            low = (self.centres - half - 0.5).clamp(-limit, limit).floor()
            high = (self.centres + half + 0.5).clamp(-limit, limit).ceil()
            return torch.cat((low, high), -1).long()  # half a pixel of slack swallows rounding


def finite_rows(gaussians: Gaussians) -> Bool[Tensor, " N"]:
    """(N,) bool: every value of the Gaussian is finite."""
    fields = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities[:, None])
    rows = [f.isfinite().all(-1) for f in fields] + [gaussians.sh.isfinite().flatten(1).all(-1)]
    return torch.stack(rows).all(0)


def drawable_rows(scene: Scene) -> Bool[Tensor, " N"]:
    """(N,) bool: every value of the Gaussian and each of its weights is finite.

    Raises:
        ValueError: a weight row does not belong to a Gaussian.
    """
    count, values = len(scene.gaussians), scene.semantics.weight_values
    if values.shape[0] != count:
        raise ValueError(f"weight_ids: expected {count} rows, received {values.shape[0]}")
    return finite_rows(scene.gaussians) & values.isfinite().all(-1)


def view_depths(gaussians: Gaussians, camera: Camera) -> Float[Tensor, " N"]:
    """z (N,) of every mean in the camera's frame, scene units.

    Term by term: matrix products of two libraries round a third of the rows differently, and
    nothing promises that one kernel rounds all rows alike. Equal means must have equal depths,
    and the renderer, which computes the same terms, the same order.
    """
    x, y, z = gaussians.means.unbind(-1)
    row = camera.viewmat.to(gaussians.means)[2]
    return x * row[0] + y * row[1] + z * row[2] + row[3]


def view_colours(gaussians: Gaussians, camera: Camera) -> Float[Tensor, "N 3"]:
    """Colours (N, 3) as this camera sees them, in its light, clamped at 0, not above; parallel rays have its
    axis."""
    viewmat = camera.viewmat.to(gaussians.means)
    if camera.orthographic:
        directions = viewmat[2, :3].expand_as(gaussians.means)
    else:
        position = -viewmat[:3, :3].T @ viewmat[:3, 3]
        directions = normalize(gaussians.means - position, dim=-1)
    signal = sh_to_signal(gaussians.sh, directions)
    if camera.light is not None:
        gains, offsets = camera.light.to(signal)
        signal = (signal - offsets) / gains
    return signal.clamp_min(0)


def project(gaussians: Gaussians, camera: Camera, near: float = NEAR) -> Footprints:
    """Footprints of the Gaussians that can touch the image, sorted by z, nearest first.

    Left out, none of which changes a pixel: values that are not finite, means nearer than
    `near` (scene units), opacities below 1/255, footprints beside the image.

    Args:
        gaussians: N of them, any float dtype; quaternions need not be unit.
        camera: skew is ignored; the principal point may be off centre.
    """
    dtype = gaussians.means.dtype
    finite = finite_rows(gaussians)
    depths = view_depths(gaussians, camera)
    ids = (finite & (depths >= near) & (gaussians.opacities >= ALPHA_MIN)).nonzero().squeeze(-1)
    ids = ids[depths.detach()[ids].argsort(stable=True)]
    means, quats, scales, opacities, depths = (
        v.index_select(0, ids)
        for v in (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, depths)
    )
    pos_c = transform(camera.viewmat.to(dtype), means)
    centres, roots = _footprint(pos_c, quats, scales, camera)
    sorted_all = Footprints(ids, centres, roots, opacities, depths, int((~finite).sum()))
    x0, y0, x1, y1 = sorted_all.boxes().unbind(-1)
    seen = ((x1 > 0) & (y1 > 0) & (x0 < camera.width) & (y0 < camera.height)).nonzero().squeeze(-1)
    return Footprints(
        *(v.index_select(0, seen) for v in (ids, centres, roots, opacities, depths)),
        num_dropped=sorted_all.num_dropped,
    )


def _footprint(pos_c: Tensor, quats: Tensor, scales: Tensor, camera: Camera) -> tuple[Tensor, Tensor]:
    """Centres (n, 2) and Cholesky factors (n, 3), pixels, of Gaussians with means `pos_c` (n, 3)."""
    K = camera.K.to(pos_c)
    focal = torch.stack((K[0, 0], K[1, 1]))
    principal = K[:2, 2]
    rotation = camera.viewmat[:3, :3].to(pos_c)
    axes_c = rotation @ (quats_to_matrices(quats) * scales[:, None, :])  # (n, 3, 3)
    if camera.orthographic:
        return pos_c[:, :2] * focal + principal, _cholesky(axes_c[:, :2] * focal[:, None])
    size = torch.tensor([camera.width, camera.height]).to(pos_c)
    depths = pos_c[:, 2:]
    slopes = pos_c[:, :2] / depths
    margin = TAN_MARGIN * 0.5 * size / focal
    clamped = slopes.clamp(-principal / focal - margin, (size - principal) / focal + margin)
    scaled = axes_c / depths[..., None]
    half = (scaled[:, :2] - clamped[..., None] * scaled[:, 2:]) * focal[:, None]  # A, (n, 2, 3)
    return slopes * focal + principal, _cholesky(half)


def _cholesky(half: Tensor) -> Tensor:
    """(l11, l21, l22) of A A^T + e I, (n, 3), for A (n, 2, 3); see the module's notation."""
    top, bottom = half[:, 0], half[:, 1]
    minors = torch.linalg.cross(top, bottom)
    var_x = (top * top).sum(-1) + DILATION
    var_y = (bottom * bottom).sum(-1) + DILATION
    det = (minors * minors).sum(-1) + DILATION * (var_x + var_y - DILATION)
    l11 = var_x.sqrt()
    return torch.stack((l11, (top * bottom).sum(-1) / l11, (det / var_x).sqrt()), -1)
