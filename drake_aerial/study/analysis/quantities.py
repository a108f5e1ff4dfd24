"""The measured quantities of a flight: key in the records, name, unit and format."""

from dataclasses import dataclass

FAILURES = ("dropped", "crashed", "diverged")
"""Outcomes of a failed flight."""


@dataclass(frozen=True)
class Quantity:
    """One number of a flight.

    Attributes
    ----------
    key : str
        Its key in a record's metrics, in SI units.
    name : str
    unit : str
        Unit in the report.
    factor : float
        From SI to `unit`.
    digits : int
        Decimal places in the report.
    """

    key: str
    name: str
    unit: str
    factor: float
    digits: int = 1

    def write(self, value: float | None, sign: bool = False) -> str:
        """Return a value in SI as text in `unit`, without the unit; a dash for None."""
        if value is None:
            return "–"
        text = f"{self.factor * value:{'+' if sign else ''}.{self.digits}f}"
        return text.replace("-", "−")

    def bracket(self, low: float | None, high: float | None) -> str:
        """Return an interval in SI as text "[low, high]" in `unit`; empty for None."""
        if low is None or high is None:
            return ""
        return f"[{self.write(low)}, {self.write(high)}]"


DEGREES = 57.29577951308232
QUANTITIES = (
    Quantity("position_rmse_m", "distance from the path, RMS", "cm", 100.0),
    Quantity("velocity_rmse_m_s", "velocity error, RMS", "cm/s", 100.0),
    Quantity("attitude_rmse_rad", "attitude error, RMS", "°", DEGREES),
    Quantity("position_max_m", "distance from the path, peak", "cm", 100.0),
    Quantity("tilt_mean_rad", "tilt, mean", "°", DEGREES),
    Quantity("tilt_max_rad", "tilt, peak", "°", DEGREES),
    Quantity("thrust_mean_N", "thrust per quadrotor, mean", "N", 1.0, 3),
    Quantity("thrust_max_N", "thrust per quadrotor, peak", "N", 1.0, 2),
    Quantity("moment_rms_N_m", "moment per quadrotor, RMS", "mN m", 1000.0, 2),
    Quantity("slack_fraction", "time with a slack cable", "%", 100.0),
    Quantity("saturated_fraction", "time at a propeller's limit", "%", 100.0, 2),
    Quantity("tension_max_N", "cable tension, peak", "N", 1.0, 2),
)
BY_KEY = {quantity.key: quantity for quantity in QUANTITIES}
MAIN = "position_rmse_m"
"""Key of the quantity by which contacts are judged first."""
