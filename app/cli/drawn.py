"""What a scene takes where it is drawn: on a graphics card, or in memory where the processor draws. The
numbers are those of `app.gl`, told without it, which needs OpenGL and torch.
"""

_READ_FLOATS = 3 + 1 + 4 + 3  # place, opacity, rotation, scales, that its vertices have
_DRAWN_FLOATS = 4 + 4 + 3  # place, shape and colour, that are made of them for a camera
_ORDER, _TINT, _WEIGHT = 4, 1, 8  # bytes: of its row, of its mark, of an atom with its weight
_MOST_BASES = 16  # of harmonics, that are shown
MOST_LAYERS = 8
"""On the card at once."""


def bytes_drawn(gaussians: int, num_bases: int, weights: int, layers: int | None) -> int:
    """That Gaussians take while all are drawn as quads, textures of pictures and of answers apart. Tiles
    (app/gl/tiled/) take 80 more of each Gaussian, and 16 of each tile that it touches.

    Args:
        num_bases: of harmonics, S. weights: kept of each Gaussian. layers: None: it has none.
    """
    vec4s = -(-3 * min(num_bases, _MOST_BASES) // 4)
    each = 4 * (_READ_FLOATS + 4 * vec4s + _DRAWN_FLOATS) + _ORDER + _TINT + _WEIGHT * weights
    return round(gaussians * min(1.0, MOST_LAYERS / (layers or 1))) * each
