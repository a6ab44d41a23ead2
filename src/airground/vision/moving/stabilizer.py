"""A moving camera held still by what it sees of the ground (section 4.3), without marks and without adding up errors.

Every frame is compared with a key frame directly: the key frame's corners are looked for where the frame should show
them. The first frame is a key frame and the stable frame; as long as enough of it is in view nothing can drift. Where
the camera goes on, key frames are added, tied to all older ones that show the same ground, and when it comes home the
loop is closed (`pose_graph`). A frame that cannot be tied in says so, and later ones find back by descriptors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import readonly
from airground.vision.moving.atlas import Atlas, View
from airground.vision.moving.coarse import Coarse
from airground.vision.moving.features import ground_mask, sharpness
from airground.vision.moving.lens_check import LensCheck
from airground.vision.moving.stabilization import Stabilization
from airground.vision.moving.working_image import WorkingImage

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.geometry.arrays import FloatArray
    from airground.geometry.lens import DivisionLens
    from airground.vision.frame import Frame
    from airground.vision.moving.key_frames import Registration

__all__ = ["Stabilizer", "StabilizerOptions"]

DULL = 0.5  # of the usual sharpness: a frame that fails and is less sharp is called blurred
FADE = 0.95


@dataclass(frozen=True, slots=True)
class StabilizerOptions:
    """How the ground is followed. The defaults suit a camera of 640 pixels and more over textured ground."""

    largest_px: int = 960
    """Images are worked on at this width at most [px]: features are found to a tenth of a pixel of that."""

    cell_px: int = 60
    """Features are spread over cells of this size [px]."""

    per_cell: int = 2
    """Most features in a cell."""

    least: int = 16
    """Features that must agree, four or more."""

    least_share: float = 0.35
    """Share of those followed that must agree."""

    renew_below: float = 0.6
    """A key frame is added when no other shows more of the view than this."""

    most_key_frames: int = 60
    """Key frames that are kept; those not used for longest go first."""

    def __post_init__(self) -> None:
        for name, least in (("largest_px", 160), ("cell_px", 16), ("per_cell", 1), ("least", 4)):
            if getattr(self, name) < least:
                raise InputError(f"{name} must be {least} or more, not {getattr(self, name)}")
        for name in ("least_share", "renew_below"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name} must lie between 0 and 1, not {getattr(self, name)}")
        if self.most_key_frames < 3:
            raise InputError(f"most_key_frames must be 3 or more, not {self.most_key_frames}")


class Stabilizer:
    """Homographies to the first frame, from the images alone.

    The stable frame is the image of the first frame that shows enough to follow.

    Parameters
    ----------
    options : StabilizerOptions, optional
        How the ground is followed.
    points : (N, 2) array_like [px], optional
        Fixed points of the ground in the first frame, at least four, at corners that can be followed. Then only these
        are used, and the view must stay on them.
    lens : DivisionLens, optional
        Of the camera. Without it a lens bends what a homography keeps straight.
    """

    def __init__(
        self,
        options: StabilizerOptions | None = None,
        points: ArrayLike | None = None,
        *,
        lens: DivisionLens | None = None,
    ) -> None:
        self.options = options or StabilizerOptions()
        self.lens = lens
        self._points = None if points is None else readonly(points, (None, 2), "points")
        if self._points is not None and len(self._points) < 4:
            raise InputError(
                f"points: {len(self._points)} were given, a homography needs 4 or more"
            )
        self._work: WorkingImage | None = None
        self._atlas: Atlas | None = None
        self._coarse = Coarse()
        self._lens_check = LensCheck()
        self._sharp = 0.0
        self._t: float | None = None

    @property
    def key_frames(self) -> tuple[int, ...]:
        """Indices of the frames that are kept."""
        return () if self._atlas is None else self._atlas.indices()

    def update(self, frame: Frame, ignore: ArrayLike | None = None) -> Stabilization:
        """Take the next frame.

        Parameters
        ----------
        frame : Frame
            Later than the last one, of the same size.
        ignore : (K, 4, 2) array_like [px], optional
            Outlines of what moves or stands out of the ground: vehicles. Without them robust fitting must do.

        Returns
        -------
        stabilization : Stabilization
            Of this frame.

        Raises
        ------
        InputError
            If the size changes, the time does not ascend, or the outlines have another shape.
        """
        if self._t is not None and not frame.t > self._t:
            raise InputError(f"a frame's time must ascend: {frame.t} s after {self._t} s")
        if self._work is None:
            self._work = WorkingImage.of(frame.size_px, self.options.largest_px, self.lens)
        outlines = np.empty((0, 4, 2)) if ignore is None else np.asarray(ignore, dtype=np.float64)
        if outlines.ndim != 3 or outlines.shape[1:] != (4, 2):
            raise InputError(f"ignore must have shape (K, 4, 2), not {outlines.shape}")
        grey = self._work.image(frame)
        self._t = frame.t
        mask = ground_mask(self._work.size_px, self._work.points(outlines))
        view = View(frame.index, grey, mask)
        sharp = sharpness(grey)
        if self._atlas is None:
            return self._begin(frame, view, sharp)
        guess = self._coarse.guess(grey)
        found = self._atlas.locate(view, guess)
        if found is None:
            self._coarse.lose()
            dull = sharp < DULL * self._sharp
            status: Literal["blurred", "lost"] = "blurred" if dull else "lost"
            return Stabilization(frame.t, status, points=self._atlas.tried, lens=self.lens)
        self._sharp = FADE * self._sharp + (1 - FADE) * sharp
        self._coarse.found(grey, found.stable_from_image, found.registration)
        if sharp >= DULL * self._sharp and self._points is None:
            self._atlas.grow(view, found)
        key = self._atlas.index(found.key)
        return self._answer(frame, found.registration, key, *self._atlas.pose(found))

    def _begin(self, frame: Frame, view: View, sharp: float) -> Stabilization:
        """The first frame with enough features becomes the stable one."""
        assert self._work is not None
        points = None if self._points is None else self._work.points(self._points)
        atlas = Atlas(self.options, view, points)
        count = len(atlas.features())
        if count < (4 if points is not None else self.options.least):
            return Stabilization(frame.t, "too few points", points=count, lens=self.lens)
        self._atlas, self._sharp = atlas, sharp
        self._coarse.begin(view.image, atlas.features())
        return Stabilization(
            frame.t,
            "ok",
            np.eye(3),
            np.zeros((8, 8)),
            count,
            count,
            0.0,
            key_frame=frame.index,
            lens=self.lens,
        )

    def _answer(
        self,
        frame: Frame,
        registration: Registration,
        key: int,
        H: FloatArray,
        covariance: FloatArray,
    ) -> Stabilization:
        assert self._work is not None
        fit = registration.fit
        note = ""
        if self.lens is None:
            note = self._lens_check.update(fit, registration.uv, self._work.size_px)
        matrix, covariance = self._work.outwards(H, covariance)
        return Stabilization(
            frame.t,
            "ok",
            matrix,
            covariance,
            len(fit.inliers),
            int(fit.inliers.sum()),
            fit.rms_px / self._work.scale,
            key_frame=key,
            note=note,
            lens=self.lens,
        )
