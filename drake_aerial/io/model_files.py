"""Shipped models: payloads, demonstrations, studies, meshes."""

import os
from pathlib import Path

from drake_aerial.errors import InputError

_PACKAGE = Path(__file__).resolve().parents[1]


def models_dir() -> Path:
    """Return the folder of the shipped models, of an installed package or of a checkout."""
    for candidate in (_PACKAGE / "share" / "models", _PACKAGE.parent / "models"):
        if (candidate / "package.xml").is_file():
            return candidate
    raise InputError(f"the shipped models were not found beside {_PACKAGE}; reinstall drake-aerial")


def names(kind: str) -> list[str]:
    """Return the names of the shipped "payloads", "demonstrations" or "studies"."""
    return sorted(path.stem for path in (models_dir() / kind).glob("*.yaml"))


def find(kind: str, name_or_path: str | Path) -> Path:
    """Return the path of a file that is given by its path or by the name of a shipped model.

    Parameters
    ----------
    kind : str
        "payloads", "demonstrations" or "studies".
    name_or_path : str or Path
        A shipped model's name ("flat"), or the path of a YAML file.

    Raises
    ------
    InputError
        If neither exists; the message lists the names that do.
    """
    path = Path(name_or_path)
    if os.path.isfile(path):
        return path
    shipped = models_dir() / kind / f"{name_or_path}.yaml"
    if path.name == str(name_or_path) and os.path.isfile(shipped):
        return shipped
    singular = {"studies": "study"}.get(kind, kind.removesuffix("s"))
    raise InputError(
        f"`{singular}` must be a YAML file or one of {', '.join(names(kind))}, "
        f"got {str(name_or_path)!r} (no such file)"
    )
