"""The result of one flight: metrics and time series, saved to metrics.json and trial.npz."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.archives import load_archive
from drake_aerial.io.files import replacing, write_text
from drake_aerial.io.strict_yaml import mapping_from_json, shown

SCHEMA = "drake_aerial/trial"
VERSION = 1
METRICS_FILE = "metrics.json"
SERIES_FILE = "trial.npz"


@dataclass(frozen=True, eq=False)
class TrialResult:
    """Result of one flight, whatever its outcome.

    Attributes
    ----------
    metrics : dict
        The metrics.json document: outcome, metrics, timing, configuration.
    series : dict of arrays
        See `recording.record`: T samples of n quadrotors.
    phase_names : tuple of str
        Names of the integers in `series["phase"]`.
    vertices, faces : (V, 3) array [m], (F, 3) int array
        The payload's surface in L.
    p_LC : (n, 3) array
        Contacts in L [m].
    cable_length : (n,) array
        Cable lengths [m].

    Examples
    --------
    >>> from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> result = Flight(box, FlightOptions(trajectory=HoverTrajectory(hover_time=0.5))).run(0)
    >>> result.series["tension"].shape, round(float(result.series["tension"][-1, 0]), 1)
    ((51, 1), 2.5)
    """

    metrics: dict[str, Any]
    series: dict[str, Array]
    phase_names: tuple[str, ...]
    vertices: Array
    faces: Array
    p_LC: Array
    cable_length: Array

    @property
    def outcome(self) -> str:
        """One of completed, dropped, crashed, diverged."""
        return str(self.metrics["outcome"])

    def save(self, folder: str | Path) -> None:
        """Write metrics.json and trial.npz into a folder, each atomically.

        Raises
        ------
        InputError
            If they cannot be written.
        """
        folder = Path(folder)
        arrays: dict[str, Any] = {f"series/{name}": value for name, value in self.series.items()}
        with replacing(folder / SERIES_FILE) as temporary:
            np.savez_compressed(
                temporary,
                metrics=np.array(json.dumps(self.metrics)),
                phase_names=np.array(self.phase_names),
                vertices=self.vertices,
                faces=self.faces,
                p_LC=self.p_LC,
                cable_length=self.cable_length,
                **arrays,
            )
        write_text(
            folder / METRICS_FILE, json.dumps(self.metrics, indent=1, allow_nan=False) + "\n"
        )

    @classmethod
    def load(cls, path: str | Path) -> TrialResult:
        """Read a trial.npz, or the one in a folder.

        Raises
        ------
        InputError
            If it is missing, damaged, or of another schema or version.
        """
        path = Path(path)
        path = path / SERIES_FILE if os.path.isdir(path) else path
        data = load_archive(path, "a trial")
        try:
            metrics = mapping_from_json(str(data["metrics"]), f"{path}: metrics")
            found = (metrics.get("schema"), metrics.get("version"))
            if found != (SCHEMA, VERSION):
                raise InputError(
                    f"{path}: `schema` and `version` must be ({SCHEMA!r}, {VERSION}), "
                    f"got {shown(found)}"
                )
            names = tuple(str(name) for name in data["phase_names"])
            series = {
                k.removeprefix("series/"): v for k, v in data.items() if k.startswith("series/")
            }
            fixed = {k: data[k] for k in ("vertices", "faces", "p_LC", "cable_length")}
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise InputError(f"cannot read a trial from {path}: {error}") from error
        return cls(metrics, series, names, **fixed)

    def summary(self) -> str:
        """Return a summary of one to three lines."""
        m = self.metrics
        ended = (
            f" at {m['outcome_time_s']:.2f} s: {m['outcome_reason']}" if m["outcome_reason"] else ""
        )
        after = m.get("after_drop")
        if after is not None:
            rest = (
                "the others held the payload"
                if after["outcome"] == "held"
                else f"{after['outcome']}: {after['reason']}"
            )
            ended += f"; {rest} ({after['time_s'] - m['outcome_time_s']:.2f} s later)"
        if m["position_rmse_m"] is None:
            return f"{self.outcome}{ended}\nno errors: the flight ended before the scored phases"
        circle = m["circle_position_rmse_m"]
        alone = "" if circle is None else f", circle alone {100 * circle:.2f} cm"
        return "\n".join(
            [
                f"{self.outcome}{ended}",
                f"position RMSE {100 * m['position_rmse_m']:.2f} cm "
                f"(largest {100 * m['position_max_m']:.2f} cm){alone}",
                f"largest tilt {np.rad2deg(m['tilt_max_rad']):.1f} deg, "
                f"mean thrust {m['thrust_mean_N']:.2f} N, "
                f"largest tension {m['tension_max_N']:.2f} N",
            ]
        )
