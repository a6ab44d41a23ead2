"""Whether a robot is at its goal, with a margin between coming and leaving, and no more asked than is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from airground.control.state import RobotState

__all__ = ["Arrival"]

Grade = Literal["there", "near", "between", "away"]


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """Tolerances in the image and on the ground; both are met."""

    tolerance_px: float
    """In the image [px]."""

    tolerance_m: float
    """On the ground [m]."""

    def grade(
        self, error_px: float, error_m: float, state: RobotState, step: tuple[float, float]
    ) -> Grade:
        """How near it is.

        Parameters
        ----------
        error_px : float [px]
            Distance to the goal in the image.
        error_m : float [m]
            The same on the ground.
        state : RobotState
            Its covariance widens what counts as near, where there is one.
        step : (float, float) [m]
            Displacement to the goal on the ground.

        Returns
        -------
        grade : str
            "there" within half of the tolerances, "near" within them, "away" beyond twice them, else "between".
        """
        error = max(error_px / self.tolerance_px, error_m / self.tolerance_m)
        if error <= 0.5:
            return "there"
        if state.covariance is not None:
            spread = _mahalanobis_squared(state, step)
            if error <= 3 and spread <= 1:
                return "there"
            if spread <= 25 and error > 2:  # 5 sigma: noise alone
                return "between"
        if error <= 1:
            return "near"
        return "between" if error <= 2 else "away"


def _mahalanobis_squared(state: RobotState, step: tuple[float, float]) -> float:
    """Of a displacement, by the covariance of the place; infinite where that is none."""
    if state.covariance is None:
        return float("inf")
    (a, b), (_, d) = state.covariance[:2, :2].tolist()
    determinant = a * d - b * b
    if not (determinant > 0 and a > 0):
        return float("inf")
    x, y = step
    return float((d * x * x - 2 * b * x * y + a * y * y) / determinant)
