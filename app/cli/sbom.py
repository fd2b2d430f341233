"""What is installed, as a bill of materials: CycloneDX 1.6, out of the packages' own metadata."""

import re
from importlib.metadata import Distribution, distributions
from typing import Any

import langflash_core

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def bill_of_materials() -> dict[str, Any]:
    """Every installed package with version and licence, and what it asks for of those; sorted by name."""
    found = {_name(each.metadata["Name"]): each for each in distributions() if each.metadata["Name"]}
    refs = {name: f"pkg:pypi/{name}@{each.version}" for name, each in sorted(found.items())}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {"type": "application", "name": "langflash", "version": langflash_core.__version__}
        },
        "components": [_component(found[name], name, ref) for name, ref in refs.items()],
        "dependencies": [
            {"ref": ref, "dependsOn": sorted({refs[need] for need in _needs(found[name]) if need in refs})}
            for name, ref in refs.items()
        ],
    }


def _name(name: str) -> str:
    """As registries compare names (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _needs(package: Distribution) -> set[str]:
    """Names of what it asks for, of extras too."""
    starts = (_NAME.match(line) for line in package.requires or ())
    return {_name(start[0]) for start in starts if start}


def _component(package: Distribution, name: str, ref: str) -> dict[str, Any]:
    fields = package.metadata.json
    told = fields.get("license_expression") or fields.get("license") or ""
    short = str(told).strip().partition("\n")[0][:120]
    licences = {"licenses": [{"license": {"name": short}}]} if short else {}
    return {
        "type": "library",
        "name": name,
        "version": package.version,
        "purl": ref,
        "bom-ref": ref,
        **licences,
    }
