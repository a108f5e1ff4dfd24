"""Dryden turbulence against spectra and correlations that scipy.signal gets from its filters."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from scipy import signal
from scipy.integrate import quad

from drake_aerial.errors import InputError
from drake_aerial.plant.dryden import Dryden, mean_wind
from drake_aerial.plant.wind import Wind, WindParameters

SECONDS, PERIOD = 400.0, 0.005


def transfer(component, s, T):
    """MIL-F-8785C's forming filters, for white noise whose two-sided density is one."""
    if component == 0:
        return signal.TransferFunction([s * np.sqrt(2.0 * T)], [T, 1.0])
    return signal.TransferFunction(
        [s * np.sqrt(T) * np.sqrt(3.0) * T, s * np.sqrt(T)], [T * T, 2.0 * T, 1.0]
    )


def density(component, s, T, omega):
    """Two-sided, over the frequency in Hz."""
    return np.abs(signal.freqresp(transfer(component, s, T), omega)[1]) ** 2


@pytest.fixture(scope="module")
def turbulence():
    return Dryden((1.0, 0.7, 0.4), (0.3, 0.2, 0.1))


@pytest.fixture(scope="module")
def series(turbulence):
    builder = DiagramBuilder()
    wind = builder.AddSystem(Wind(WindParameters(turbulence=turbulence), PERIOD))
    log = LogVectorOutput(wind.get_output_port(), builder, PERIOD)
    simulator = Simulator(builder.Build())
    wind.set_seed(wind.GetMyMutableContextFromRoot(simulator.get_mutable_context()), 11)
    simulator.AdvanceTo(SECONDS)
    return np.array(log.FindLog(simulator.get_context()).data().T)[1:]


@pytest.mark.parametrize("component", [0, 1, 2])
def test_variance_is_the_integral_of_the_spectrum(turbulence, series, component):
    s, T = turbulence.intensity[component], turbulence.time[component]
    variance = quad(lambda w: density(component, s, T, [w])[0] / np.pi, 0.0, np.inf, limit=200)[0]
    assert variance == pytest.approx(s * s, rel=1e-6)
    # 400 s are at least 1300 time scales.
    assert series[:, component].var() == pytest.approx(variance, rel=0.12)
    assert abs(series[:, component].mean()) < 5.0 * s * np.sqrt(2.0 * T / SECONDS)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_measured_spectrum_is_the_filters(turbulence, series, component):
    s, T = turbulence.intensity[component], turbulence.time[component]
    frequency, measured = signal.welch(
        series[:, component], 1.0 / PERIOD, nperseg=4096, detrend=False
    )
    # Bands of equal ratio, each averaged over windows and frequencies, and all below the
    # frequencies that are affected by aliasing.
    edges = np.array([0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0]) / (2.0 * np.pi * 0.2) * 2.0
    for low, high in pairwise(edges):
        band = (frequency >= low) & (frequency < high)
        expected = 2.0 * density(component, s, T, 2.0 * np.pi * frequency[band])
        assert measured[band].mean() == pytest.approx(expected.mean(), rel=0.25), (low, high)
    # A first-order filter of the same variance is far off: the test would see it.
    if component > 0:
        band = (frequency > 3.0) & (frequency < 12.0)
        first_order = 2.0 * density(0, s, T, 2.0 * np.pi * frequency[band]).mean()
        assert measured[band].mean() > 1.3 * first_order


def test_discretisation_is_exact():
    """The stationary variance is kept, and the correlation is that of the continuous filter."""
    turbulence, period = Dryden((1.0, 0.7, 0.4), (0.3, 0.2, 0.1)), 0.05
    Phi, N, C, N0 = turbulence.steps(period)
    lags = np.arange(12)
    for k in range(3):
        s, T = turbulence.intensity[k], turbulence.time[k]
        P = N0 @ N0.T
        assert Phi[k] @ P @ Phi[k].T + N[k] @ N[k].T == pytest.approx(P, abs=1e-14)
        found = [C[k] @ np.linalg.matrix_power(Phi[k], n) @ P @ C[k] for n in lags]
        # The autocorrelation is the integral of h(t) h(t + lag), h the impulse response.
        t = np.linspace(0.0, 40.0 * T, 100_001)
        h = signal.impulse(transfer(k, s, T), T=t)[1]
        expected = []
        for n in lags:
            shift = round(n * period / t[1])
            expected.append(np.trapezoid(h[: len(h) - shift] * h[shift:], dx=t[1]))
        assert found == pytest.approx(expected, abs=2e-3 * s * s)


def test_a_short_period_loses_no_digits():
    _, N, _, _ = Dryden((1.0, 1.0, 1.0), (500.0, 500.0, 500.0)).steps(1e-3)
    assert (N[:, 1, 1] > 0.0).all()
    # To leading order the noise of the second state is a^(3/2) / sqrt(12).
    assert N[0, 1, 1] == pytest.approx((1e-3 / 500.0) ** 1.5 / np.sqrt(12.0), rel=1e-3)


def test_low_altitude_is_the_standard_in_feet():
    # At 20 ft and 15 knots at 20 ft: L_w = 20 ft, sigma_w = 1.5 kt, and the formulas by hand.
    knot, foot = 0.514444, 0.3048
    found = Dryden.low_altitude(20.0 * foot, 15.0 * knot)
    slope = 0.177 + 0.01646
    assert found.intensity == pytest.approx(
        (1.5 * knot / slope**0.4, 1.5 * knot / slope**0.4, 1.5 * knot)
    )
    length = 20.0 * foot / slope**1.2
    assert found.time == pytest.approx(np.array([length, length, 20.0 * foot]) / (15.0 * knot))
    # At 1000 ft it becomes isotropic, with scales of 1000 ft.
    high = Dryden.low_altitude(1000.0 * foot, 10.0, airspeed=20.0)
    assert high.intensity == pytest.approx((1.0, 1.0, 1.0), rel=1e-3)
    assert high.time == pytest.approx(np.full(3, 1000.0 * foot / 20.0), rel=1e-3)
    assert mean_wind(20.0 * foot, 7.0) == pytest.approx(7.0)
    assert 0.85 < mean_wind(10.0 * foot, 1.0) < 0.9


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((1.0, 5.0), "altitude"),
        ((400.0, 5.0), "altitude"),
        ((10.0, 0.0), "wind_at_20_feet"),
        ((10.0, 5.0, -1.0), "airspeed"),
        ((10.0, np.inf), "wind_at_20_feet"),
    ],
)
def test_what_the_standard_does_not_cover_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        Dryden.low_altitude(*arguments)


@pytest.mark.parametrize(
    "bad", [{"intensity": (1.0, -1.0, 0.0)}, {"time": (0.0, 1.0, 1.0)}, {"time": (1.0, 1.0)}]
)
def test_impossible_turbulence_is_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        Dryden(**{"intensity": (1.0, 1.0, 1.0), "time": (1.0, 1.0, 1.0), **bad})
