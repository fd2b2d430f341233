"""Numbers that `export` decides by: one frozen record a subject, each number with its unit and its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PointCloud:
    """Points that go with cameras (`export.cameras`)."""

    most_points: int = 100_000
    """Points of points3D.txt."""
    solid: float = 0.1
    """Opacity from which a Gaussian is one of them."""


POINT_CLOUD = PointCloud()


@dataclass(frozen=True)
class Codebooks:
    """Codebooks of numbers and vectors (`export.codebooks`)."""

    scalar_steps: int = 24
    """Of k-means, of numbers."""
    vector_steps: int = 5
    """Of k-means, of vectors."""
    sample: int = 16
    """Vectors per centre that the steps look at."""
    few: int = 9
    """Numbers of a vector, up to which a tree is quick: in more it looks everywhere."""
    pairs_at_once: int = 1 << 20
    """Distances: 4 MB, which a processor's cache holds."""


CODEBOOKS = Codebooks()


@dataclass(frozen=True)
class Colmap:
    """COLMAP's text files (`export.colmap`)."""

    straight: float = 1e-3
    """Distortion up to which photos count as straight."""
    longest_name: int = 4096
    """Bytes of a photo's name."""


COLMAP_TEXT = Colmap()


@dataclass(frozen=True)
class Chunks:
    """SuperSplat's compressed .ply (`export.compressed_ply`)."""

    at_once: int = 256
    """Chunks in work at once."""
    widest: float = 20.0
    """Log scales are written within this of 0."""


CHUNKS = Chunks()


@dataclass(frozen=True)
class DepthFile:
    """Pictures of depth (`export.depth`)."""

    covered: float = 0.5
    """Alpha from which a pixel shows the scene, as in answers."""


DEPTH_FILE = DepthFile()


@dataclass(frozen=True)
class Boxes:
    """Boxes in a .glb (`export.glb`)."""

    opacity: float = 0.35
    """Of a box: what stands in it stays visible."""
    thinnest: float = 1e-3
    """Of the longest side: a flat thing still gets a body."""


BOXES = Boxes()


@dataclass(frozen=True)
class Packing:
    """What other programs packed (`export.packing`)."""

    most_shrinking: int = 1032
    """Times that deflate can shrink anything (zlib's documentation)."""
    even: float = 1e-3
    """Relative: how alike the scales of a node's axes must be."""
    window: int = 1 << 23
    """Bytes that a zstd packer looks back at most, where the content is no longer."""


PACKING = Packing()


@dataclass(frozen=True)
class Columns:
    """Columns of a page (`export.page_columns`)."""

    most_weights: int = 4
    """Of a Gaussian; `langflash bench` says what the others are worth."""
    place_steps: tuple[int, int, int] = (32, 32, 4000)
    """Steps of a pixel across and down, of the photo as the network saw it, and of the logarithm of depth:
    a sixtyfourth of a pixel and an eighthousandth of the depth are lost, which another photo sees from a
    tenth of the depth aside as less than a hundredth of a pixel."""
    nearest: float = 1e-3
    """Scene units; what is nearer to its photo, or behind it, has no place in it."""


COLUMNS = Columns()


@dataclass(frozen=True)
class PlyText:
    """Headers of .ply files (`export.ply`)."""

    max_header: int = 1 << 16
    """Bytes; 3DGS headers have about 1,500."""
    blanks: int = 16
    """Bytes of white space behind the last element, which are no damage."""
    too_wide: float = 0.05
    """Of the scene: no capture is made of Gaussians that large."""
    digits: int = 18
    """Of a count; int() itself refuses some thousand with an error of its own."""


PLY_TEXT = PlyText()


@dataclass(frozen=True)
class PlyNumbers:
    """Numbers of .ply files that others wrote (`export.ply_numbers`)."""

    thin: float = 1e-6
    """Scale of the third axis of flat Gaussians."""
    norms: tuple[float, float] = (1 / 16, 16.0)
    """Of quaternions as trainers leave them; whole numbers read as halves are all over."""
    most: float = 0.9
    """Share of rows that make sense as halves."""
    blur: float = 0.02
    """Of a Gaussian's size: a step of float32 that is smaller is not seen."""
    far: float = 4.0
    """Times the scene's width: nearer to 0, a shift would save no digit."""


PLY_NUMBERS = PlyNumbers()


@dataclass(frozen=True)
class Painting:
    """Pictures of answers (`export.png`)."""

    glow: float = 0.7
    """Share of the heat colour where the photo is white, as in the window."""
    label_opacity: float = 0.6
    """Of a phrase's colour over the view, as in the window."""
    dim: float = 0.6
    """Brightness of the photo where nothing was found."""


PAINTING = Painting()


@dataclass(frozen=True)
class Quantising:
    """Numbers in few bytes (`export.quantised`)."""

    book: int = 256
    """Numbers of a codebook: one byte names each."""
    palette: int = 8192
    """Vectors of harmonics."""


QUANTISING = Quantising()


@dataclass(frozen=True)
class Sheet:
    """Sheets of pictures (`export.sheet`)."""

    caption: int = 18
    """Pixels above a picture."""
    gap: int = 2
    """Pixels around it."""
    width: int = 240
    """Pixels of a tile, before the gap."""
    light: tuple[int, int, int] = (235, 235, 235)
    """Red, green and blue of captions, of 255."""


SHEET = Sheet()


@dataclass(frozen=True)
class Sog:
    """.sog files (`export.sog`)."""

    most_meta: int = 1 << 20
    """Bytes of meta.json."""
    slack: int = 1 << 16
    """Bytes and pixels that a picture may have more than it needs."""


SOG_LIMITS = Sog()


@dataclass(frozen=True)
class SplatBytes:
    """.splat files (`export.splat`)."""

    unit: tuple[float, float] = (0.9, 1.1)
    """Norms of quaternions that were unit before they became bytes (error up to 1/64)."""
    plausible: float = 0.5
    """Share of unit quaternions below which the bytes are something else."""


SPLAT_BYTES = SplatBytes()


@dataclass(frozen=True)
class Spz:
    """.spz files (`export.spz`)."""

    most_extensions: int = 1 << 20
    """Bytes of versions 2 and 3, which do not say how many there are."""
    sh_steps: tuple[int, int] = (8, 16)
    """Of 256, degree 1 and above: 5 and 4 significant bits."""
    most_bits: int = 16
    """Of the fraction of a position; a scene 128 units wide keeps them all."""


SPZ_FORMAT = Spz()


@dataclass(frozen=True)
class Stored:
    """Numbers on their way into files (`export.stored`)."""

    rows_at_once: int = 1 << 16
    """Gaussians in work at once: 16 MB of a file with spherical harmonics of degree 3."""
    smallest: float = 1e-30
    """Of scales: below, float32 products vanish."""
    largest: float = 1e30
    """Of scales: beyond, they overflow."""
    opaque: float = 1 - 1e-7
    """Its logit, 16.1, is the largest that is written: infinity breaks other readers."""


STORED = Stored()
