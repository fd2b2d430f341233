"""The camera that a command line names: `--view`, `--camera`, `--size` and `--ortho`."""

from argparse import Namespace

from langflash_core.writing import cameras


def chosen_camera(args: Namespace) -> cameras.CameraChoice:
    """Read them.

    Raises:
        ViewError: the camera file cannot be used.
    """
    return cameras.chosen_camera(args.view, args.camera, args.size, bool(args.ortho))
