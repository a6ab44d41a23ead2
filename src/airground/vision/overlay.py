"""What the tracker believes, drawn into the camera's image: tracks, trails, ellipses, horizon, metric grid."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.calibration.inspection import inspect_calibration
from airground.calibration.metric_grid import metric_grid

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray
    from airground.vision.frame import Frame, ImageArray
    from airground.vision.tracker import Track

__all__ = ["Overlay", "OverlayOptions", "colour_of"]

SHIFT = 4  # cv2 takes coordinates in sixteenths of a pixel
FONT = cv2.FONT_HERSHEY_SIMPLEX
WHITE, DARK, RED = (255, 255, 255), (45, 38, 32), (60, 60, 235)
GRID, AXIS, HORIZON = (48, 48, 48), (90, 90, 90), (0, 94, 213)  # added to the image
# Okabe and Ito's colours, as blue, green, red: told apart by everybody.
PALETTE = ((233, 180, 86), (77, 169, 255), (66, 228, 240), (192, 143, 229), (115, 158, 0))
NINETY_FIVE = 2.4477  # radius, in standard deviations, that holds 95 % of a plane's Gaussian


@dataclass(frozen=True, slots=True)
class OverlayOptions:
    """What to draw."""

    trail_s: float = 4.0
    """How long a track's trail is [s]."""

    lost_s: float = 1.0
    """A track that was not seen for longer is not drawn [s]."""

    grid: bool = True
    """Draw horizon and metric grid, where there is a calibration."""


def colour_of(name: str) -> tuple[int, int, int]:
    """Colour of a target; the same name has the same colour in every picture.

    Parameters
    ----------
    name : str
        Of the target.

    Returns
    -------
    colour : (int, int, int)
        Blue, green, red.
    """
    return PALETTE[sum(name.encode()) % len(PALETTE)]


class Overlay:
    """Draws one frame after the other, and remembers trails.

    Parameters
    ----------
    options : OverlayOptions, optional
        What to draw.
    calibration : Calibration, optional
        Gives horizon, grid and speeds in m/s. Of the stable frame, where the camera moves.
    names : mapping of str to str, optional
        What to write instead of a track's name.
    """

    def __init__(
        self,
        options: OverlayOptions | None = None,
        *,
        calibration: Calibration | None = None,
        names: Mapping[str, str] | None = None,
    ) -> None:
        self._options = options or OverlayOptions()
        self._names = dict(names or {})
        self._calibration = calibration
        self._trails: dict[str, deque[tuple[float, FloatArray]]] = {}
        self._lines: list[tuple[FloatArray, tuple[int, int, int], int]] | None = None
        self._light: ImageArray | None = None

    def draw(
        self,
        frame: Frame,
        tracks: Sequence[Track],
        *,
        image_from_stable: FloatArray | None = None,
        status: str = "",
        alarm: bool = False,
        ground: bool = True,
    ) -> ImageArray:
        """Draw tracks into a copy of a frame.

        Parameters
        ----------
        frame : Frame
            What the camera saw.
        tracks : sequence of Track
            What the tracker believes, in the stable frame.
        image_from_stable : (3, 3) array, optional
            Takes the stable frame's points to this image, where the camera moves.
        status : str
            A line for the top left corner, beside the time.
        alarm : bool
            Draw that line in red.
        ground : bool
            Draw horizon and grid, if there is a calibration: not in a frame whose place is unknown.

        Returns
        -------
        image : (H, W, 3) array of uint8
            Blue, green, red.
        """
        image = _coloured(frame.image)
        if ground and self._calibration is not None and self._options.grid:
            self._draw_ground(image, frame, image_from_stable)
        for track in tracks:
            self._remember(track)
        for track in tracks:
            if track.confirmed and track.lost_for <= self._options.lost_s:
                self._draw_track(image, track, image_from_stable)
        for name in [n for n, trail in self._trails.items() if self._old(trail, frame.t)]:
            del self._trails[name]
        line = f"{frame.t:8.2f} s"
        _label(image, (8, 20), f"{line}  {status}" if status else line, RED if alarm else WHITE)
        return image

    def _old(self, trail: deque[tuple[float, FloatArray]], now: float) -> bool:
        return now - trail[-1][0] > self._options.trail_s

    def _remember(self, track: Track) -> None:
        trail = self._trails.setdefault(track.name, deque())
        trail.append((track.t, track.uv))
        while track.t - trail[0][0] > self._options.trail_s:
            trail.popleft()

    def _draw_track(
        self, image: ImageArray, track: Track, image_from_stable: FloatArray | None
    ) -> None:
        colour = colour_of(track.name)
        trail = np.array([uv for _, uv in self._trails[track.name]])
        _polyline(image, _mapped(trail, image_from_stable), colour, 2)
        at = _mapped(track.uv[None], image_from_stable)[0]
        if not _drawable(at):
            return
        ring = _mapped(_ellipse(track.uv, track.covariance[:2, :2]), image_from_stable)
        _polyline(image, ring, WHITE if track.lost_for > 0 else colour, 1, closed=True)
        ahead = _mapped((track.uv + 0.5 * track.uv_dot)[None], image_from_stable)[0]
        if _drawable(ahead):
            _polyline(image, np.stack([at, ahead]), WHITE, 1)  # where it is in half a second
        centre = np.rint(at * 2**SHIFT).astype(int)
        cv2.circle(
            image, (int(centre[0]), int(centre[1])), 3 << SHIFT, colour, -1, cv2.LINE_AA, SHIFT
        )
        text = self._names.get(track.name, track.name) + self._speed(track)
        if track.lost_for > 0:
            text += f"  lost {track.lost_for:.1f} s"
        _label(image, (int(at[0]) + 10, int(at[1]) - 10), text, colour)

    def _speed(self, track: Track) -> str:
        if self._calibration is None or not bool(self._calibration.is_ground(track.uv)):
            return ""
        xy_dot, _ = self._calibration.ground_velocity(track.uv, track.uv_dot)
        return f"  {float(np.linalg.norm(xy_dot)):.2f} m/s"

    def _draw_ground(
        self, image: ImageArray, frame: Frame, image_from_stable: FloatArray | None
    ) -> None:
        if self._lines is None:
            self._lines = self._ground_lines(frame)
        if self._light is None or image_from_stable is not None:
            self._light = np.zeros_like(image)
            for line, colour, width in self._lines:
                _polyline(self._light, _mapped(line, image_from_stable), colour, width)
        cv2.add(image, self._light, dst=image)  # lines of light: the ground stays visible below

    def _ground_lines(self, frame: Frame) -> list[tuple[FloatArray, tuple[int, int, int], int]]:
        """Grid and horizon in the stable frame; they are those of the first image."""
        assert self._calibration is not None
        width, height = frame.size_px
        grid = metric_grid(self._calibration, (0.0, 0.0, width - 1.0, height - 1.0))
        lines = [
            (line, AXIS if axis else GRID, 2 if axis else 1)
            for line, axis in zip(grid.lines, grid.axes, strict=True)
        ]
        horizon = inspect_calibration(self._calibration).horizon_uv
        return [*lines, (horizon, HORIZON, 3)]


def _coloured(image: ImageArray) -> ImageArray:
    """Own copy in colour."""
    if image.ndim == 2:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    return image.copy()


def _mapped(uv: FloatArray, matrix: FloatArray | None) -> FloatArray:
    """Points through a collineation; NaN behind the horizon of the map."""
    if matrix is None:
        return uv
    w = uv @ matrix[:, :2].T + matrix[:, 2]
    # A collineation of two views of one ground keeps the sign of the depth for what both see.
    middle = uv.mean(axis=0) if np.isfinite(uv).all() else np.nanmean(uv, axis=0)
    sign = np.sign(middle @ matrix[2, :2] + matrix[2, 2])
    depth = np.where(w[:, 2:] * sign > 0, w[:, 2:], np.nan)
    return np.asarray(w[:, :2] / depth)


def _ellipse(uv: FloatArray, covariance: FloatArray) -> FloatArray:
    """(33, 2). Border of the region that holds 95 %."""
    values, vectors = np.linalg.eigh(covariance)
    phi = np.linspace(0, 2 * np.pi, 33)
    circle = np.column_stack([np.cos(phi), np.sin(phi)])
    axes = vectors * (NINETY_FIVE * np.sqrt(np.maximum(values, 0)))
    return np.asarray(uv + circle @ axes.T)


def _drawable(uv: FloatArray) -> bool:
    return bool(np.isfinite(uv).all() and (np.abs(uv) < 2**14).all())


def _polyline(
    image: ImageArray,
    uv: FloatArray,
    colour: tuple[int, int, int],
    width: int,
    *,
    closed: bool = False,
) -> None:
    """Lines through points, in pieces where a point is missing or far outside."""
    # Beyond, cv2's fixed point overflows; NaN compares as False.
    good = np.asarray((np.abs(uv) < 2**14).all(axis=1))
    if not good.any():
        return
    cuts = np.flatnonzero(np.diff(good.astype(np.int8))) + 1
    for piece, ok in zip(np.split(uv, cuts), np.split(good, cuts), strict=True):
        if ok[0] and len(piece) > 1:
            points = np.rint(piece * 2**SHIFT).astype(np.int32)
            cv2.polylines(image, [points], closed, colour, width, cv2.LINE_AA, SHIFT)


def _label(image: ImageArray, at: tuple[int, int], text: str, colour: tuple[int, int, int]) -> None:
    """Text on a dark ground, moved so that all of it is in the image."""
    (width, height), base = cv2.getTextSize(text, FONT, 0.45, 1)
    x = min(max(at[0], 2), max(image.shape[1] - width - 4, 2))
    y = min(max(at[1], height + 4), image.shape[0] - base - 2)
    cv2.rectangle(image, (x - 3, y - height - 4), (x + width + 3, y + base), DARK, -1)
    cv2.putText(image, text, (x, y - 1), FONT, 0.45, colour, 1, cv2.LINE_AA)
