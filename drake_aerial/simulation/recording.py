"""The time series of a flight, from a station's logs."""

from __future__ import annotations

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
"""Phases before the reference's own: payload on the ground and cables slack, cables taking over the weight, payload rising."""

Series = dict[str, Array]


def phase_names(trajectory: Trajectory) -> tuple[str, ...]:
    """Return the names that the integers in the series `phase` stand for."""
    own = tuple(phase.name for phase in trajectory.phases if phase.name not in ("ground", "lift"))
    return TAKE_OFF + own


def record(station: TransportStation, context: Context, trajectory: Trajectory) -> Series:
    """Return the series of a flight, sampled every 10 ms; T samples, n quadrotors.

    Parameters
    ----------
    station : TransportStation
        With a controller inside.
    context : Context
        Of the station, after the simulation.
    trajectory : Trajectory
        As it was flown (`TransportStation.place`).

    Returns
    -------
    dict of arrays
        time (T,) [s], phase (T,) int, payload_position, payload_velocity, reference_position, reference_velocity, com_position (T, 3) [m, m/s],
        payload_quaternion (T, 4), payload_rate (T, 3) [rad/s], attitude_error, tilt (T,) [rad], quadrotor_position (T, n, 3),
        quadrotor_quaternion (T, n, 4), contact_position (T, n, 3), tension, thrust (T, n) [N], moment (T, n, 3) [N m], in Q,
        saturated (T, n) bool: a propeller at a limit; attached (T, n) bool: the gripper holds; with wind also wind (T, 3) [m/s],
        the air's velocity in the world.
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
    # A simulation that broke off in the middle of a step may have logged some of its ports only.
    count = min([len(payload)] + [len(log) for log in logs])
    keep = np.isfinite(payload[:count]).all(axis=1) & np.isfinite(logs[0][:count]).all(axis=1)
    time, payload = time[:count][keep], payload[:count][keep]
    quadrotors, tension, commands, speeds, control, attached, *wind = (
        log[:count][keep] for log in logs
    )
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
    """Return the phase (T,) int at every sample: the take-off's while it lasts and the reference rises, then the reference's."""
    names = phase_names(trajectory)
    phase = np.minimum(control, 2.0).astype(np.int64)
    for part in trajectory.phases:
        if part.name in names[len(TAKE_OFF) :]:
            phase[time >= part.start - 1e-9] = names.index(part.name)
    return phase
