"""Contact skill: the models that `transfer` uses, learnt from one demonstration; .npz file."""

from __future__ import annotations

import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose
from drake_aerial.io.archives import load_archive
from drake_aerial.io.files import write_bytes
from drake_aerial.io.record_text import record_to_mapping
from drake_aerial.io.records import record_from_mapping
from drake_aerial.io.strict_yaml import mapping_from_json, shown
from drake_aerial.skill.configuration_model import ConfigurationModel
from drake_aerial.skill.contact_model import ContactModel
from drake_aerial.skill.object_model import ObjectModel
from drake_aerial.skill.parameters import LearningParameters
from drake_aerial.skill.task_model import TaskModel

SCHEMA = "drake_aerial/skill"
VERSION = 1

_FEATURE_ARRAYS = ("p", "q", "r", "anisotropy", "rim")
# Earlier programs read files of this version and require `alpha` in their configuration. It had no
# effect on any result (docs/readings.md); it is written and not read.
_ALPHA = 50.0


@dataclass(frozen=True, eq=False)
class ContactSkill:
    """The models learnt from one demonstration with n grippers, in its canonical frame N (z up).

    Attributes
    ----------
    label : str
        Name of the skill.
    description : str
        One sentence about the demonstration.
    parameters : LearningParameters
        Parameters of learning.
    X_SN : Pose
        The canonical frame N in the frame S of the demonstration's cloud.
    points : (M, 3) array
        The demonstration's downsampled cloud, in N [m].
    X_NG, X_NQ : Pose
        Demonstrated grippers and quadrotors, batches (n,).
    hull : HorizontalHull
        Convex hull of the demonstration seen from above, in N.
    objects, contacts : tuples of n
        Object model and contact model of each gripper.
    task : TaskModel
        The task model.
    configuration : ConfigurationModel
        The configuration model.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from drake_aerial import ContactSkill, read_skill
    >>> skill = read_skill("flat")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     skill.save(Path(folder) / "flat.npz")
    ...     again = ContactSkill.load(Path(folder) / "flat.npz")
    >>> again.to_bytes() == skill.to_bytes()
    True
    """

    label: str
    description: str
    parameters: LearningParameters
    X_SN: Pose
    points: Array
    X_NG: Pose
    X_NQ: Pose
    hull: HorizontalHull
    objects: tuple[ObjectModel, ...]
    contacts: tuple[ContactModel, ...]
    task: TaskModel
    configuration: ConfigurationModel

    def __len__(self) -> int:
        """Return the number of grippers n."""
        return len(self.objects)

    def to_bytes(self) -> bytes:
        """Return the skill as an .npz archive without pickled objects.

        The same skill gives the same bytes.
        """
        c = self.configuration
        metadata = {
            "label": self.label,
            "description": self.description,
            "grippers": len(self),
            "parameters": record_to_mapping(self.parameters),
            "rho": self.task.features.rho,
            "edge_saliency": self.task.features.edge_saliency,
            "configuration": {
                "sigma_p": c.sigma_p,
                "sigma_q": c.sigma_q,
                "alpha": _ALPHA,
                "axial": c.axial,
            },
        }
        arrays: dict[str, np.ndarray] = {
            "schema": np.array(SCHEMA),
            "version": np.array(VERSION),
            "label": np.array(self.label),
            "metadata": np.array(json.dumps(metadata, sort_keys=True)),
            "points": self.points,
            "hull": self.hull.vertices,
            "task_weights": self.task.weights,
            "configuration_p_FQ": c.p_FQ,
            "configuration_cable_length": c.cable_length,
        }
        poses = {
            "X_SN": self.X_SN,
            "X_NG": self.X_NG,
            "X_NQ": self.X_NQ,
            "configuration_X_FG": c.X_FG,
        }
        features = {"task": self.task.features, "salient": self.task.salient}
        for n, (o, m) in enumerate(zip(self.objects, self.contacts)):
            features[f"object{n}"] = o.features
            poses[f"contact{n}_X_vG"] = m.X_vG
            arrays[f"contact{n}_r"], arrays[f"contact{n}_weights"] = m.descriptor, m.weights
        for name, X in poses.items():
            arrays[f"{name}.p"], arrays[f"{name}.q"] = X.p, X.q
        for name, f in features.items():
            for part in _FEATURE_ARRAYS:
                arrays[f"{name}.{part}"] = getattr(f, part)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
        return buffer.getvalue()

    def save(self, path: str | Path) -> None:
        """Write the skill to an .npz file atomically.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        write_bytes(path, self.to_bytes())

    @classmethod
    def load(cls, path: str | Path) -> ContactSkill:
        """Read a skill that `save` wrote; arrays are equal bit by bit.

        Raises
        ------
        InputError
            If the file is missing, is not such an archive, has another schema or version, or is
            incomplete.
        """
        arrays = _read(Path(path))
        schema, version = str(arrays.get("schema", "none")), arrays.get("version")
        if schema != SCHEMA:
            raise InputError(f"{path}: `schema` must be {SCHEMA!r}, got {shown(schema)}")
        if (
            version is None
            or version.shape != ()
            or version.dtype.kind not in "iu"
            or int(version) != VERSION
        ):
            given = shown(None if version is None else version.tolist())
            raise InputError(
                f"{path}: `version` must be {VERSION}, got {given}; learn the skill again"
            )
        try:
            return cls._from_arrays(arrays)
        except (
            KeyError,
            TypeError,
            ValueError,
            IndexError,
            AttributeError,
            OverflowError,
            RecursionError,
        ) as error:
            raise InputError(f"{path} is an incomplete or damaged skill: {error}") from error

    @classmethod
    def _from_arrays(cls, arrays: dict[str, np.ndarray]) -> ContactSkill:
        metadata = mapping_from_json(str(arrays["metadata"]), "metadata")
        metadata["configuration"].pop("alpha", None)
        parameters = record_from_mapping(LearningParameters, metadata["parameters"], "parameters")
        rho, edge_saliency = metadata["rho"], metadata["edge_saliency"]

        def pose(name: str) -> Pose:
            return Pose(arrays[f"{name}.p"], arrays[f"{name}.q"])

        def features(name: str) -> SurfaceFeatures:
            parts: dict[str, Any] = {part: arrays[f"{name}.{part}"] for part in _FEATURE_ARRAYS}
            return SurfaceFeatures(**parts, rho=rho, edge_saliency=edge_saliency)

        bandwidth, count = parameters.bandwidth, range(metadata["grippers"])
        return cls(
            label=metadata["label"],
            description=metadata["description"],
            parameters=parameters,
            X_SN=pose("X_SN"),
            points=arrays["points"],
            X_NG=pose("X_NG"),
            X_NQ=pose("X_NQ"),
            hull=HorizontalHull(arrays["hull"]),
            objects=tuple(ObjectModel(features(f"object{n}"), bandwidth) for n in count),
            contacts=tuple(
                ContactModel(
                    pose(f"contact{n}_X_vG"),
                    arrays[f"contact{n}_r"],
                    arrays[f"contact{n}_weights"],
                    bandwidth,
                )
                for n in count
            ),
            task=TaskModel(
                features("task"), arrays["task_weights"], features("salient"), bandwidth
            ),
            configuration=ConfigurationModel(
                pose("configuration_X_FG"),
                arrays["configuration_p_FQ"],
                arrays["configuration_cable_length"],
                **metadata["configuration"],
            ),
        )


def _read(path: Path) -> dict[str, np.ndarray]:
    if not os.path.isfile(path):
        raise InputError(f"no such file: {path}; `drake-aerial learn` writes a skill")
    return load_archive(path, "a skill")
