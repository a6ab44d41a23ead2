"""Whether residuals show a lens that nobody told of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.vision.moving.small_motion import homography_jacobian, moved_by

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.moving.fit_types import HomographyFit

__all__ = ["LensCheck"]

SURE = 5.0  # deviations
WORTH_PX = 1.0  # displacement of the image's corner
FADE = 0.98


class LensCheck:
    """Adds up what the frames tell of one number, the division model's k1 about the image's middle.

    With a lens both images of a match are bent, so the residual has the pattern ``J b(source) - b(target)``, where b is
    the displacement that a unit of k1 gives and J the derivative of the homography. What the homography can explain of
    that pattern is taken out first.
    """

    def __init__(self) -> None:
        self._information = 0.0
        self._gradient = 0.0

    def update(self, fit: HomographyFit, uv: FloatArray, size_px: tuple[int, int]) -> str:
        """Take in a frame.

        Parameters
        ----------
        fit : HomographyFit
            Key frame from image.
        uv : (N, 2) array [px]
            Its source points.
        size_px : (int, int) [px]
            Width and height of the image.

        Returns
        -------
        note : str
            What to tell the user, empty where there is nothing to tell.
        """
        if fit.matrix is None or fit.inliers.sum() < 20:
            return ""
        middle = (np.array(size_px) - 1) / 2
        corner = float(np.hypot(*middle))
        source, r = uv[fit.inliers], fit.residuals[fit.inliers]
        J = homography_jacobian(fit.matrix, source)
        w = np.concatenate([source, np.ones((len(source), 1))], axis=1) @ fit.matrix.T
        target = w[:, :2] / w[:, 2:] + r
        # Undistorted = raw - k r^2 (raw - middle); k is scaled so that 1 moves the corner by 1 px.
        pattern = _bend(target - middle, corner) - np.einsum(
            "nij,nj->ni", J, _bend(source - middle, corner)
        )
        A = (J @ moved_by(source)).reshape(-1, 8)
        A = A / np.linalg.norm(A, axis=0)
        Q, _ = np.linalg.qr(A)
        x, y = pattern.ravel(), r.ravel()
        x = x - Q @ (Q.T @ x)
        variance = max(fit.rms_px**2, 1e-4)
        self._information = FADE * self._information + float(x @ x) / variance
        self._gradient = FADE * self._gradient + float(x @ y) / variance
        if self._information <= 0:
            return ""
        # Frames that follow each other have much of their error in common: counted as a few.
        information = self._information * (1 - FADE)
        bend = self._gradient / self._information
        if abs(bend) < WORTH_PX or abs(bend) * np.sqrt(information) < SURE:
            return ""
        share = 100 * abs(bend) / corner
        kind = "barrel" if bend < 0 else "pincushion"
        return (
            f"the residuals look like a {kind} lens that moves the corners by {share:.1f} % of their "
            "distance from the middle; give the lens"
        )


def _bend(d: FloatArray, corner: float) -> FloatArray:
    """Displacement that moves a corner by one pixel and others by the cube of their distance."""
    share = np.sum(d**2, axis=-1, keepdims=True) / corner**2
    return np.asarray(share * d / corner)
