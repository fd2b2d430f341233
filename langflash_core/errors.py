"""Everything that can go wrong for a user, in one tree.

Each message is one clear sentence and ends with what to do about it. Commands turn
`LangFlashError` into that sentence on stderr and `exit_code`; they write nothing.
"""


class LangFlashError(Exception):
    """Root of the tree. `exit_code` is what a command returns."""

    exit_code = 1


class InputError(LangFlashError):
    """The user gave something that cannot be used; says what, and the remedy."""

    exit_code = 2


class ImageError(InputError):
    """A photo is missing, unreadable, or too small."""


class FilmError(InputError):
    """A film is missing, cannot be decoded, or shows nothing that a scene can be made of."""


class SceneFileError(InputError):
    """A scene file is missing, truncated, foreign, or of another version."""


class ViewError(InputError):
    """A view index or camera file does not describe a usable camera."""


class PromptError(InputError):
    """A prompt is empty, or speaks another language space than the scene."""


class OutputError(InputError):
    """An output path cannot be written."""


class WeightsError(InputError):
    """A checkpoint is missing, damaged, or does not fit the network."""


class DownloadError(LangFlashError):
    """A file could not be fetched from the network."""


class GraphicsError(LangFlashError):
    """OpenGL is not available or too old for what was asked."""


class MissingPackageError(LangFlashError):
    """An optional package is not installed; says which extra brings it."""


class Cancelled(LangFlashError):
    """The user stopped the work; nothing was written."""
