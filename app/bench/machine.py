"""What a time was measured on."""

import importlib.metadata
import os
import platform
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import langflash_core

if TYPE_CHECKING:
    import moderngl

_PACKAGES = ("moderngl", "numpy", "torch")
_THREADS = ("LP_NUM_THREADS", "OMP_NUM_THREADS")  # how many the software rasteriser and torch may use


def machine(ctx: "moderngl.Context") -> dict:
    """GPU, driver, processor and versions, as plain JSON values."""
    return {
        "gpu": ctx.info["GL_RENDERER"],
        "vendor": ctx.info["GL_VENDOR"],
        "driver": ctx.info["GL_VERSION"],
        **host(),
    }


def host() -> dict:
    """Processor, system and versions, without asking for graphics; plain JSON values."""
    return {
        "processor": _processor(),
        "cpus": os.cpu_count(),
        "threads": {name: os.environ[name] for name in _THREADS if name in os.environ},
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {
            "langflash": langflash_core.__version__,
            "python": platform.python_version(),
            **{name: importlib.metadata.version(name) for name in _PACKAGES if find_spec(name)},
        },
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())
