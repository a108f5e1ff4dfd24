"""Time series of a flight, from the logs of a station."""

from typing import Any

import numpy as np
from pydrake.systems.framework import Context

from drake_aerial.geometry import (
    Array,
    matrix_from_quat,
    quat_conjugate,
    quat_multiply,
    rotation_angle,
)
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.station import TransportStation

TAKE_OFF = ("ground", "tensioning", "lifting")
"""Phases of the take-off, before those of the reference.

Payload on the ground and cables slack; cables take over the weight; payload rises.
"""

Series = dict[str, Array]


def phase_names(trajectory: Trajectory) -> tuple[str, ...]:
    """Return the names of the integers in the series `phase`."""
    own = tuple(phase.name for phase in trajectory.phases if phase.name not in ("ground", "lift"))
    return TAKE_OFF + own


def record(station: TransportStation, context: Context, trajectory: Trajectory) -> Series:
    """Return the time series of a flight: T samples every 10 ms, n quadrotors.

    Parameters
    ----------
    station : TransportStation
        With a controller inside.
    context : Context
        Of the station, after the simulation.
    trajectory : Trajectory
        Reference as it was flown, returned by `TransportStation.place`.

    Returns
    -------
    dict of arrays
        Vectors are in the world unless another frame is named.

        - time (T,) [s]; phase (T,) int, see `phase_names`;
        - payload_position, reference_position, com_position (T, 3) [m];
        - payload_velocity, reference_velocity (T, 3) [m/s]; payload_rate (T, 3) [rad/s];
        - payload_quaternion (T, 4); attitude_error, tilt (T,) [rad];
        - quadrotor_position, contact_position (T, n, 3) [m]; quadrotor_quaternion (T, n, 4);
        - tension, thrust (T, n) [N]; moment (T, n, 3) in Q [N m];
        - saturated (T, n) bool: a propeller is at a limit; attached (T, n) bool: the gripper holds;
        - wind (T, 3) [m/s], with wind only: velocity of the air.
    """
    time, payload = station.log(context, "payload.state")
    names = [
        "quadrotors.state",
        "cables.tension",
        "propellers.command",
        "propellers.squared_speed",
        "controller.phase",
    ]
    names += ["cables.attached"] + ["wind.velocity"] * (station.wind is not None)
    logs = [station.log(context, name)[1] for name in names]
    keep = np.isfinite(payload).all(axis=1) & np.isfinite(logs[0]).all(axis=1)
    time, payload = time[keep], payload[keep]
    quadrotors, tension, commands, speeds, control, attached, *wind = (log[keep] for log in logs)
    n = station.n
    team = station.parameters.quadrotors(n)
    quadrotors, commands, speeds = (
        quadrotors.reshape(-1, n, 13),
        commands.reshape(-1, n, 4),
        speeds.reshape(-1, n, 4),
    )
    R_WL = matrix_from_quat(payload[:, :4])
    desired = trajectory.sample(time)
    wrench = np.einsum("nij,tnj->tni", np.stack([q.allocation for q in team]), speeds)
    low, high = np.array([q.command_limits for q in team]).T[:, :, None]
    at_limit = (commands <= low * (1.0 + 1e-9)) | (commands >= high * (1.0 - 1e-9))
    return {
        "time": time,
        "phase": _phases(trajectory, time, control[:, 0]),
        "payload_position": payload[:, 4:7],
        "payload_quaternion": payload[:, :4],
        "payload_velocity": payload[:, 10:13],
        "payload_rate": payload[:, 7:10],
        "reference_position": desired.p,
        "reference_velocity": desired.v,
        "attitude_error": rotation_angle(quat_multiply(quat_conjugate(desired.q), payload[:, :4])),
        "tilt": np.arccos(np.clip(R_WL[:, 2, 2], -1.0, 1.0)),
        "com_position": payload[:, 4:7] + R_WL @ station.payload.com,
        "quadrotor_position": quadrotors[:, :, 4:7],
        "quadrotor_quaternion": quadrotors[:, :, :4],
        "contact_position": payload[:, None, 4:7] + np.einsum("tij,nj->tni", R_WL, station.p_LC),
        "tension": tension,
        "thrust": wrench[:, :, 0],
        "moment": wrench[:, :, 1:],
        "saturated": at_limit.any(axis=2),
        "attached": attached > 0.5,
        **({"wind": wind[0]} if wind else {}),
    }


def _phases(trajectory: Trajectory, time: Array, control: Array) -> Any:
    """Return the phase (T,) int: that of the take-off, then that of the reference."""
    names = phase_names(trajectory)
    phase = np.minimum(control, 2.0).astype(np.int64)
    for part in trajectory.phases:
        if part.name in names[len(TAKE_OFF) :]:
            phase[time >= part.start - 1e-9] = names.index(part.name)
    return phase
