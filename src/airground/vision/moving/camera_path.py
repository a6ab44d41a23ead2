"""How the camera has moved, and what can be expected of the next frame."""

from __future__ import annotations

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.moving.small_motion import apply_homography, difference, move

__all__ = ["CameraPath"]

USUAL = 8.0  # times the usual error of the prediction: no jump yet
FADE = 0.95  # memory of the usual error, per frame


class CameraPath:
    """The last homographies. The next is expected to go on at the same speed."""

    def __init__(self) -> None:
        self._t: list[float] = []
        self._H: list[FloatArray] = []
        self._usual_px = 0.0
        self._lately = 0.0

    def predicted(self, t: float) -> FloatArray | None:
        """Where the next frame is expected.

        Parameters
        ----------
        t : float [s]
            Its time.

        Returns
        -------
        stable_from_image : (3, 3) array or None
            None where there is no frame yet.
        """
        if not self._H:
            return None
        if len(self._H) < 2:
            return self._H[-1]
        share = (t - self._t[1]) / (self._t[1] - self._t[0])
        if share > 3:  # a gap: standing still is the better guess
            return self._H[1]
        return move(self._H[1], share * difference(self._H[0], self._H[1]))

    def candidates(self, t: float) -> list[FloatArray]:
        """Where the next frame may be: where the last one was, for a camera that shakes; or further on.

        Parameters
        ----------
        t : float [s]
            Its time.

        Returns
        -------
        stable_from_image : list of (3, 3) array
            None, one or two.
        """
        guess = self.predicted(t)
        return self._H[-1:] if guess is None else [*self._H[-1:], guess]

    def add(self, t: float, H: FloatArray, uv: FloatArray) -> None:
        """Take in a frame.

        Parameters
        ----------
        t : float [s]
            Its time.
        H : (3, 3) array
            Its homography.
        uv : (N, 2) array [px]
            Points of the frame by which errors are measured.
        """
        error = self._error(t, H, uv)
        if np.isfinite(error):
            # A mean that outliers move little.
            limit = 3 * self._usual_px / max(self._lately, 1e-9) if self._lately > 0.3 else np.inf
            self._usual_px = FADE * self._usual_px + (1 - FADE) * min(error, limit)
            self._lately = FADE * self._lately + (1 - FADE)
        self._t, self._H = [*self._t[-1:], t], [*self._H[-1:], H]

    def jumps(self, t: float, H: FloatArray, uv: FloatArray, sigma_px: float) -> bool:
        """Whether a homography is far from where the camera can be.

        Parameters
        ----------
        t : float [s]
            Time of the frame.
        H : (3, 3) array
            Its homography, as found.
        uv : (N, 2) array [px]
            Points of the frame.
        sigma_px : float [px]
            Deviation of a point.

        Returns
        -------
        jumps : bool
            By more than errors and the camera's usual unrest explain, given the time since the last frame.
        """
        if len(self._H) < 2 or self._lately < 0.3:
            return False
        steps = max((t - self._t[1]) / (self._t[1] - self._t[0]), 1.0)
        usual = self._usual_px / self._lately
        return self._error(t, H, uv) > steps**2 * (USUAL * usual + 6 * sigma_px)

    def _error(self, t: float, H: FloatArray, uv: FloatArray) -> float:
        guess = self.predicted(t)
        if guess is None or len(uv) == 0:
            return np.nan
        gap = apply_homography(guess, uv) - apply_homography(H, uv)
        return float(np.sqrt(np.mean(np.sum(gap**2, axis=-1))))
