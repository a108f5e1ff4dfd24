"""Sensors of a flight: noise, bias, rate and delay of every measured quantity."""

from __future__ import annotations

from drake_aerial.choices import SensorLevel
from drake_aerial.io.records import NonNegative, Positive, record


@record(frozen=True)
class Measurement:
    """How one quantity is measured; noise and bias are in the quantity's own unit.

    Examples
    --------
    >>> from drake_aerial.estimation.sensor_parameters import Measurement
    >>> Measurement(noise=0.001, delay=0.01).period
    0.01
    """

    noise: NonNegative = 0.0
    """Standard deviation of white noise, per sample and coordinate [unit of the quantity]."""
    bias: NonNegative = 0.0
    """Standard deviation of an offset that is constant during a flight, per coordinate; each seed
    draws another one [unit of the quantity]."""
    period: Positive = 0.01
    """Time between two samples, a multiple of the plant's time step [s]."""
    delay: NonNegative = 0.0
    """Age of a sample when it is first read, a multiple of the plant's time step [s]."""


@record(frozen=True)
class SensorParameters:
    """Sensors of a flight. The defaults are those of a laboratory with motion capture.

    From publications: Merriaux et al. ("A Study of Vicon System Positioning Performance", Sensors
    2017) measured position errors of 0.15 mm at rest and below 2 mm in motion; 1 mm is used. The
    gyroscope of the Bosch BMI088 has 0.014 deg/s/sqrt(Hz), taken over 100 Hz. The 14-bit magnetic
    encoder ams AS5048A has at most 0.06 deg rms of noise and 0.8 deg of non-linearity at 25 degrees
    C; half a degree is used for an encoder and its mounting.

    Estimates without a source: all periods and delays (10 ms from exposure to delivery), attitudes
    (5 mrad, of markers 0.2 m apart), velocities and the payload's and the cables' rates (filters
    that fuse motion capture with inertial sensors), accelerometer, rotor speeds, and every bias but
    that of the encoder.

    Examples
    --------
    >>> from drake_aerial import SensorParameters, StationParameters
    >>> station = StationParameters(sensors=SensorParameters())
    >>> station.sensors.level, station.sensors.payload_position.noise
    ('payload', 0.001)
    """

    level: SensorLevel = "payload"
    """What is measured: payload (motion capture of everything), cables (quadrotors, and the cables'
    angles at them) or vehicles (quadrotors alone)."""
    payload_position: Measurement = Measurement(noise=0.001, bias=0.001, delay=0.01)
    """Position of L's origin [m]; level payload."""
    payload_attitude: Measurement = Measurement(noise=0.005, bias=0.005, delay=0.01)
    """Attitude of the payload [rad]; level payload."""
    payload_velocity: Measurement = Measurement(noise=0.01, delay=0.01)
    """Velocity of L's origin [m/s]; level payload."""
    payload_rate: Measurement = Measurement(noise=0.02, delay=0.01)
    """Angular velocity of the payload [rad/s]; level payload."""
    quadrotor_position: Measurement = Measurement(noise=0.001, bias=0.001, delay=0.01)
    """Position of each quadrotor [m]."""
    quadrotor_attitude: Measurement = Measurement(noise=0.005, bias=0.005, delay=0.01)
    """Attitude of each quadrotor [rad]."""
    quadrotor_velocity: Measurement = Measurement(noise=0.01, delay=0.01)
    """Velocity of each quadrotor [m/s]."""
    quadrotor_rate: Measurement = Measurement(noise=0.003, bias=0.002)
    """Angular velocity of each quadrotor, by its gyroscope [rad/s]."""
    specific_force: Measurement = Measurement(noise=0.02, bias=0.05)
    """Acceleration of each quadrotor less gravity, by its accelerometer [m/s^2]."""
    rotor_speed: Measurement = Measurement(noise=30.0)
    """Speed of each propeller [rpm]."""
    cable_direction: Measurement = Measurement(noise=0.001, bias=0.009)
    """Direction of each cable [rad]; level cables. Level payload computes it from the positions."""
    cable_rate: Measurement = Measurement(noise=0.02)
    """Rate of the direction of each cable [1/s]; level cables."""
