"""Write the labels of a scene as an image."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_bytes
from drake_aerial.scene.scene import Scene


def write_labels(path: str | Path, scene: Scene) -> None:
    """Write the labels of a scene's pixels as a grey PNG: 0 nothing, 1 support, 2 and up objects.

    The image has 8 bits, or 16 if there are more than 254 objects.

    Raises
    ------
    InputError
        If the path does not end in .png, or cannot be written.
    """
    from PIL import Image

    path = Path(path)
    if path.suffix.lower() != ".png":
        raise InputError(f"the image of labels must end in .png, got {str(path)!r}")
    labels = scene.label_image()
    kind = np.uint8 if labels.max(initial=0) < 256 else np.uint16
    buffer = io.BytesIO()
    Image.fromarray(labels.astype(kind)).save(buffer, "PNG")
    write_bytes(path, buffer.getvalue())
