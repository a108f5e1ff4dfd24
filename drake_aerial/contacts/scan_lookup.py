"""Find the scan that a contacts.json names."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.scene.recorded_scan import read_recorded_scan


def find_scan(record: Mapping[str, Any], folder: Path | None) -> PointCloud:
    """Return the cloud that contacts were found on.

    Its path is tried as it stands, then relative to `folder`, then its file name in `folder`. The
    first file with the right points is taken.

    Parameters
    ----------
    record : mapping
        `ContactSolutions.cloud`: `path`, `sha256`, `up`, `viewpoint`, `camera` and `topic`.
    folder : Path or None
        The folder of contacts.json, if the contacts were read from a file.

    Raises
    ------
    InputError
        If the contacts name no file, no file is found, or all that are found have other points.
    """
    path = record.get("path")
    if not path:
        raise InputError("the contacts do not name a scan file")
    places = [Path(path)]
    if folder is not None:
        places += [folder / path, folder / Path(path).name]
    found = [place for place in dict.fromkeys(places) if os.path.exists(place)]
    for place in found:
        scan = read_recorded_scan(record, place)
        if record.get("sha256") in (None, "", scan.sha256):
            return scan
    if found:
        raise InputError(f"scan {found[0]} is not the scan of these contacts: its points differ")
    raise InputError(f"scan {path} of these contacts was not found, also not beside contacts.json")
