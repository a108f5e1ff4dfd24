"""Motion of a payload and the forces on it, from the record of a flight."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.estimation.momentum_windows import PayloadMotion
from drake_aerial.geometry import Array, matrix_from_quat
from drake_aerial.io.strict_yaml import shown
from drake_aerial.simulation.recording import TAKE_OFF
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.statics.gravity import GRAVITY

Forces = Literal["thrust", "tension"]
"""Source of the cables' forces: the quadrotors' own balance, or the recorded tensions."""

_CLEARANCE = 0.01
"""Height of the payload's lowest point above which it is clear of the ground [m]."""


def recorded_motion(trial: TrialResult, forces: Forces = "thrust") -> PayloadMotion:
    """Return the motion in a trial, with the force of each cable on the payload.

    With `thrust`, a cable's force is thrust and weight of its quadrotor less the rate of its
    momentum, which needs no sensor at the cable. With `tension`, it is the recorded tension along
    the cable.

    Parameters
    ----------
    trial : TrialResult
    forces : str
        `thrust` or `tension`.

    Raises
    ------
    InputError
        If `forces` is unknown, or the record has no masses of the quadrotors.

    Examples
    --------
    >>> from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload, recorded_motion
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> options = FlightOptions(trajectory=HoverTrajectory(hover_time=0.2))
    >>> recorded_motion(Flight(box, options).run()).force.shape
    (21, 1, 3)
    """
    if forces not in ("thrust", "tension"):
        raise InputError(f"`forces` must be thrust or tension, got {forces!r}")
    series = trial.series
    time, R_WL = series["time"], matrix_from_quat(series["payload_quaternion"])
    n = len(trial.p_LC)
    if forces == "tension":
        along = series["quadrotor_position"] - series["contact_position"]
        along = along / np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-9)
        force, momentum = series["tension"][..., None] * along, np.zeros((len(time), n, 3))
    else:
        mass = _flying_masses(trial.metrics, n)
        axis = matrix_from_quat(series["quadrotor_quaternion"])[..., :, 2]
        velocity = np.gradient(series["quadrotor_position"], time, axis=0, edge_order=2)
        momentum = mass[:, None] * velocity
        force = series["thrust"][..., None] * axis
        force[..., 2] -= GRAVITY * mass
    lowest = np.min(
        [series["payload_position"][:, 2] + R_WL[:, 2] @ vertex for vertex in trial.vertices],
        axis=0,
    )
    lifted = series["phase"] >= TAKE_OFF.index("lifting")
    return PayloadMotion(
        time=time,
        p_WL=series["payload_position"],
        v_WL=series["payload_velocity"],
        R_WL=R_WL,
        W_L=np.einsum("tji,tj->ti", R_WL, series["payload_rate"]),
        p_LC=trial.p_LC,
        force=force,
        momentum=momentum,
        attached=series["attached"].astype(bool),
        carried=lifted & (lowest > _CLEARANCE),
        other=np.zeros((len(time), 6)),
    )


def _flying_masses(metrics: dict[str, Any], n: int) -> Array:
    """Return the masses (n,) of the quadrotors with the links of their cables [kg]."""
    try:
        station = metrics["configuration"]["station"]
        masses = _each(station["quadrotor"], "mass", n)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            "metrics.json must hold the mass of each quadrotor in configuration.station.quadrotor, "
            f"got {shown(metrics.get('configuration'))}"
        ) from error
    cables = station.get("cable", {})
    elastic = isinstance(cables, dict) and cables.get("kind") == "elastic"
    return masses if elastic else masses + _each(cables, "link_mass", n, 0.0)


def gripper_masses(trial: TrialResult) -> Array:
    """Return the masses (n,) of the grippers of a trial [kg]; zeros where they are not recorded."""
    station = trial.metrics.get("configuration", {}).get("station", {})
    return _each(station.get("gripper", {}), "mass", len(trial.p_LC), 0.0)


def _each(parts: Any, key: str, n: int, default: float | None = None) -> Array:
    """Return a number (n,) of n parts, recorded as a list or as one for all."""
    parts = parts if isinstance(parts, list) else [parts] * n
    return np.array(
        [float(part[key] if default is None else part.get(key, default)) for part in parts]
    )
