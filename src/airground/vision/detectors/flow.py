"""Points of the operator's choice, followed from frame to frame.

Each is followed by pyramids of Lucas and Kanade, forward and back, which bridges fast motion, and then aligned with its
first appearance by an affine map and a change of brightness, so that nothing drifts (Evangelidis and Psarakis, ECC,
PAMI 2008). A point that does not look like itself gives no sighting; it is searched near where it should be.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.vision.detectors.images import grey_of
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from airground.vision.frame import Frame, ImageArray

__all__ = ["PointDetector"]

MOST_PULL_PX = 4.0  # from where flow or search put it
MOST_BEND = 0.25  # of the patch, from one sighting to the next
BACK_PX = 1.0  # there and back again
LEAST_CORRELATION = 0.8
LEAST_TEXTURE = 4.0  # grey levels, standard deviation within the window
FLOOR_PX = 0.01
UNIQUE = 0.05  # between the best and the second best place in a search
WHOLE = 0.97  # of the patch must be in the image: a part of it pulls to one side
SEARCH_PX, MOST_SEARCH_PX = 24, 120
CRITERIA = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 1e-4)


@dataclass(slots=True, eq=False)
class _Point:
    """One point and all that is known about it."""

    label: str
    """What to call it."""

    template: NDArray[np.float32]
    """(S, S). Its first appearance."""

    place: FloatArray
    """(2,) [px]. Where it is, or was last."""

    offset: FloatArray
    """(2,) [px]. From the middle pixel of the template to the point."""

    shape: NDArray[np.float32]
    """(2, 2). How the template's surroundings have turned and stretched since."""

    velocity: FloatArray = field(default_factory=lambda: np.zeros(2))
    """(2,) [px/s]."""

    lost: int = 0
    """Frames since it was seen."""

    t: float = 0.0
    """When it was seen last [s]."""


class PointDetector:
    """Follows points.

    The labels are 1, 2, ... in the order given. What is followed is the patch around a point; its position is that of
    the point as it was given in the first frame, carried along.

    Parameters
    ----------
    points : (N, 2) array_like [px]
        Where they are in the first frame.
    window_px : int
        Side of the patch around a point; odd.
    names : sequence of str
        Labels of one's own.
    """

    def __init__(
        self, points: ArrayLike, *, window_px: int = 31, names: Sequence[str] = ()
    ) -> None:
        self._start = readonly(points, (None, 2), "points")
        if not len(self._start):
            raise InputError("give one point or more to follow")
        if window_px < 9 or window_px % 2 == 0:
            raise InputError(f"window_px must be odd and 9 or more, not {window_px}")
        self._names = tuple(names) or tuple(str(k + 1) for k in range(len(self._start)))
        if len(self._names) != len(self._start) or len(set(self._names)) != len(self._names):
            raise InputError(f"names must be {len(self._start)} different names")
        self._half = window_px // 2
        self._points: list[_Point] = []
        self._before: ImageArray | None = None

    def detect(self, frame: Frame) -> Sightings:
        """Follow the points into a frame.

        Parameters
        ----------
        frame : Frame
            The next frame; the first is the one that the points were chosen in.

        Returns
        -------
        sightings : Sightings
            With labels, without headings; a point that is lost is left out.

        Raises
        ------
        InputError
            In the first frame, if a point is not in it or nothing can be seen there.
        """
        grey = grey_of(frame)
        if self._before is None or self._before.shape != grey.shape:
            if self._points:
                raise InputError(
                    f"frame {frame.index} has shape {grey.shape}, expected that of the first frame"
                )
            self._points = [self._new(grey, k) for k in range(len(self._start))]
            for point in self._points:
                point.t = frame.t
            self._before = grey
            return self._first(frame.t)
        guesses = self._flow(grey, frame.t)
        rows = []
        for point, guess in zip(self._points, guesses, strict=True):
            found = None if guess is None else self._align(grey, point, guess, point.shape)
            if found is None:
                found = self._search(grey, point, frame.t)
            if found is None:
                point.lost += 1
                continue
            uv, shape, covariance, correlation = found
            dt = frame.t - point.t
            if dt > 0 and not point.lost:
                point.velocity = (uv - point.place) / dt
            elif point.lost:
                point.velocity = np.zeros(2)
            point.place, point.shape, point.t, point.lost = uv, shape, frame.t, 0
            rows.append((point.label, uv, covariance, correlation))
        self._before = grey
        if not rows:
            return Sightings.none(frame.t)
        uv = np.array([row[1] for row in rows])
        return Sightings(
            frame.t,
            uv,
            np.array([row[2] for row in rows]),
            tuple(row[0] for row in rows),
            score=np.clip([row[3] for row in rows], 0.0, 1.0),
            outline=uv[:, None, :] + self._square(),
        )

    def _square(self) -> FloatArray:
        return self._half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])

    def _first(self, t: float) -> Sightings:
        """The points where the operator put them: exact, as that is what they are."""
        return Sightings.round(t, self._start, FLOOR_PX, labels=self._names)

    def _new(self, grey: ImageArray, k: int) -> _Point:
        place = np.array(self._start[k])
        middle = np.rint(place).astype(int)
        height, width = grey.shape
        low, high = middle - self._half, middle + self._half
        if (low < 0).any() or high[0] >= width or high[1] >= height:
            raise InputError(
                f"point {self._names[k]} at {place[0]:g},{place[1]:g} must be {self._half} px or more "
                f"inside the image of {width}x{height}"
            )
        template = grey[low[1] : high[1] + 1, low[0] : high[0] + 1].astype(np.float32)
        if float(template.std()) < LEAST_TEXTURE:
            raise InputError(
                f"point {self._names[k]} at {place[0]:g},{place[1]:g} shows nothing to follow; "
                "choose a corner or a spot with contrast"
            )
        return _Point(self._names[k], template, place, place - middle, np.eye(2, dtype=np.float32))

    def _flow(self, grey: ImageArray, t: float) -> list[FloatArray | None]:
        """Where optical flow takes the points that were seen in the frame before."""
        guesses: list[FloatArray | None] = [None] * len(self._points)
        rows = [k for k, point in enumerate(self._points) if not point.lost]
        if not rows or self._before is None:
            return guesses
        size = (2 * (self._half // 2) + 1,) * 2
        start = np.array([self._points[k].place for k in rows], dtype=np.float32).reshape(-1, 1, 2)
        steps = [self._points[k].velocity * (t - self._points[k].t) for k in rows]
        ahead = start + np.array(steps, dtype=np.float32).reshape(-1, 1, 2)
        flags = cv2.OPTFLOW_USE_INITIAL_FLOW
        there, ok, _ = cv2.calcOpticalFlowPyrLK(
            self._before, grey, start, ahead.copy(), winSize=size, maxLevel=3, flags=flags
        )
        back, ok_back, _ = cv2.calcOpticalFlowPyrLK(
            grey, self._before, there, start.copy(), winSize=size, maxLevel=3, flags=flags
        )
        error = np.hypot(*(back - start).reshape(-1, 2).T)
        for i, k in enumerate(rows):
            if ok[i, 0] and ok_back[i, 0] and error[i] < BACK_PX:
                guesses[k] = there[i, 0].astype(np.float64)
        return guesses

    def _search(
        self, grey: ImageArray, point: _Point, t: float
    ) -> tuple[FloatArray, NDArray[np.float32], FloatArray, float] | None:
        """A lost point near where it should be; farther away the longer it is lost."""
        reach = min(SEARCH_PX * (1 + point.lost), MOST_SEARCH_PX)
        speed = point.velocity if point.lost < 10 else np.zeros(2)
        middle = np.rint(point.place + speed * (t - point.t)).astype(int)
        low = np.maximum(middle - reach - self._half, 0)
        high = np.minimum(middle + reach + self._half + 1, [grey.shape[1], grey.shape[0]])
        if (high - low < 2 * self._half + 1).any():
            return None
        window = grey[low[1] : high[1], low[0] : high[0]]
        template = self._seen_from(point).astype(np.uint8)
        match = cv2.matchTemplate(window, template, cv2.TM_CCOEFF_NORMED)
        _, best, _, where = cv2.minMaxLoc(np.nan_to_num(match, posinf=0.0, neginf=0.0))
        if best < LEAST_CORRELATION - 0.1:
            return None
        # Twice in one window is no answer: the second best, apart from the first, must be worse.
        rest = match.copy()
        u, v = where
        near = self._half // 2
        rest[max(v - near, 0) : v + near + 1, max(u - near, 0) : u + near + 1] = -1.0
        if float(rest.max()) > best - UNIQUE:
            return None
        guess = low + np.array(where) + self._half + point.shape @ point.offset
        return self._align(grey, point, guess, point.shape)

    def _seen_from(self, point: _Point) -> NDArray[np.float32]:
        """The template as it looked when the point was last seen."""
        inverse = np.linalg.inv(point.shape.astype(np.float64))
        middle = np.full(2, float(self._half))
        warp = np.column_stack([inverse, middle - inverse @ middle])
        size = (2 * self._half + 1,) * 2
        return np.asarray(
            cv2.warpAffine(
                point.template,
                warp,
                size,
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            dtype=np.float32,
        )

    def _align(
        self, grey: ImageArray, point: _Point, guess: FloatArray, shape: NDArray[np.float32]
    ) -> tuple[FloatArray, NDArray[np.float32], FloatArray, float] | None:
        """Align with the first appearance; place, shape, covariance and correlation."""
        half = self._half
        corner = np.rint(guess).astype(int) - 2 * half
        low = np.maximum(corner, 0)
        high = np.minimum(corner + 4 * half + 1, [grey.shape[1], grey.shape[0]])
        if (high - low < 2 * half + 1).any():
            return None
        window = grey[low[1] : high[1], low[0] : high[0]].astype(np.float32)
        # Pixel p of the template is pixel A p + b of the window.
        middle = np.array([half, half], dtype=np.float64)
        b = guess - low - shape @ (middle + point.offset)
        warp = np.column_stack([shape, b]).astype(np.float32)
        try:
            # Its own smoothing (the last argument) treats the two borders unlike, and biases by 0.05 px.
            correlation, found = cv2.findTransformECC(  # type: ignore[call-overload]
                point.template, window, warp, cv2.MOTION_AFFINE, CRITERIA, None, 1
            )
        except cv2.error:  # it did not converge
            return None
        A, b = found[:, :2].astype(np.float64), found[:, 2].astype(np.float64)
        change = A @ np.linalg.inv(shape.astype(np.float64))
        bent = float(np.abs(change - np.eye(2)).max())  # since it was seen last
        stretch = float(np.linalg.det(A))
        uv = A @ (middle + point.offset) + b + low
        if correlation < LEAST_CORRELATION or not 0.2 < stretch < 5.0:
            return None
        if not np.isfinite(uv).all() or np.hypot(*(uv - guess)) > MOST_PULL_PX or bent > MOST_BEND:
            return None
        covariance = self._covariance(point, window, A, b)
        if covariance is None:
            return None
        return uv, A.astype(np.float32), covariance, float(correlation)

    def _covariance(
        self, point: _Point, window: NDArray[np.float32], A: FloatArray, b: FloatArray
    ) -> FloatArray | None:
        """From the template's gradients and what the alignment leaves over."""
        size = (2 * self._half + 1,) * 2
        warp = np.column_stack([A, b])
        seen = cv2.warpAffine(window, warp, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        inside = (
            np.asarray(
                cv2.warpAffine(
                    np.ones_like(window), warp, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
                )
            )
            > 0.99
        )
        if inside.mean() < WHOLE:
            return None
        v, u = np.gradient(np.asarray(seen, dtype=np.float64))
        V, U = np.mgrid[-1.0 : 1.0 : size[1] * 1j, -1.0 : 1.0 : size[0] * 1j]
        columns = [u, v, u * U, u * V, v * U, v * V, point.template, np.ones_like(u)]
        J = np.column_stack([np.asarray(c, dtype=np.float64)[inside] for c in columns])
        y = np.asarray(seen, dtype=np.float64)[inside]
        try:
            inverse = np.linalg.inv(J.T @ J + 1e-6 * np.eye(8))
        except np.linalg.LinAlgError:
            return None
        residual = y - J[:, 6:] @ np.linalg.lstsq(J[:, 6:], y, rcond=None)[0]
        scaled = J * residual[:, None]
        covariance = (inverse @ (scaled.T @ scaled) @ inverse)[:2, :2]
        covariance = A @ covariance @ A.T
        covariance = 0.5 * (covariance + covariance.T) + FLOOR_PX**2 * np.eye(2)
        return covariance if np.trace(covariance) < self._half**2 / 4 else None
