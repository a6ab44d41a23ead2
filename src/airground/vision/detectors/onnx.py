"""A detector of the user's own: a neural network that gives boxes, as an ONNX file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from airground.errors import InputError
from airground.vision.detectors.images import colour_of
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.geometry.arrays import FloatArray
    from airground.vision.frame import Frame, ImageArray

__all__ = ["OnnxDetector"]

GREY = 114  # the usual filling beside a letterboxed image
SIZE_PX = 640  # of an input whose size is free
SHARE_OF_BOX = 0.03  # of a box's side: how exactly networks place it


class OnnxDetector:
    """Runs a network through onnxruntime.

    The input is one image, (1, 3, H, W) of floats between 0 and 1 in the order red, green, blue; the frame is fitted
    into it with grey bars. The output is (1, N, 6), rows of left, top, right, bottom, score and class, or
    (1, 4 + C, N), columns of centre, width, height and C scores. All lengths are pixels of the input.

    A position is the centre of a box. Its standard deviation is a share of the box's sides, since such networks do not
    tell theirs.

    Parameters
    ----------
    path : str or Path
        The file.
    least_score : float
        What the network is less sure of is left out.
    classes : sequence of int
        Which classes to keep; all if empty.
    overlap : float
        Of two boxes of one class whose intersection is more than this share of their union, the better one is kept.
    share_of_box : float
        Standard deviation of a position, as a share of the box's sides.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        least_score: float = 0.25,
        classes: Sequence[int] = (),
        overlap: float = 0.45,
        share_of_box: float = SHARE_OF_BOX,
    ) -> None:
        self._path = str(path)
        for name, value in (("least_score", least_score), ("overlap", overlap)):
            if not 0 <= value <= 1:
                raise InputError(f"{name} must lie between 0 and 1, not {value}")
        if not share_of_box > 0:
            raise InputError(f"share_of_box must be positive, not {share_of_box}")
        self._least_score, self._overlap, self._share = least_score, overlap, share_of_box
        self._classes = tuple(classes)
        self._session = _session(Path(path))
        inputs = self._session.get_inputs()
        shape = inputs[0].shape if inputs else None
        if len(inputs) != 1 or shape is None or len(shape) != 4 or shape[1] != 3:
            found = ", ".join(f"{node.name} {node.shape}" for node in inputs)
            raise InputError(f"{path}: found input {found}, expected one of (1, 3, H, W)")
        if inputs[0].type != "tensor(float)" or (
            shape[0] not in (1, None) and isinstance(shape[0], int)
        ):
            raise InputError(
                f"{path}: found input {shape} of {inputs[0].type}, expected (1, 3, H, W) of tensor(float)"
            )
        self._input = inputs[0].name
        height, width = (n if isinstance(n, int) and n > 0 else SIZE_PX for n in shape[2:])
        self._size_px = (width, height)

    def detect(self, frame: Frame) -> Sightings:
        """Run the network.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            Without labels: a class is shared by many things. The best score first.

        Raises
        ------
        InputError
            If the output has another shape than those above.
        """
        tensor, scale, shift = _letterbox(colour_of(frame), self._size_px)
        outputs = self._session.run(None, {self._input: tensor})
        boxes, score, kind = self._boxes(np.asarray(outputs[0], dtype=np.float64), len(outputs))
        keep = np.isfinite(boxes).all(axis=1) & (score >= self._least_score)
        keep &= (boxes[:, 2:] > boxes[:, :2]).all(axis=1)
        if self._classes:
            keep &= np.isin(kind, self._classes)
        boxes, score, kind = boxes[keep], score[keep], kind[keep]
        # The letterbox maps edges of pixels: u + 0.5 is what it scales.
        boxes = (boxes - np.tile(shift, 2)) / scale - 0.5
        rows = _best(boxes, score, kind, self._overlap)
        boxes, score = boxes[rows], score[rows]
        if not len(boxes):
            return Sightings.none(frame.t)
        sides = boxes[:, 2:] - boxes[:, :2]
        covariance = np.zeros((len(boxes), 2, 2))
        sigma = np.maximum(self._share * sides, 0.3)
        covariance[:, [0, 1], [0, 1]] = sigma**2
        return Sightings(
            frame.t,
            (boxes[:, :2] + boxes[:, 2:]) / 2,
            covariance,
            score=np.clip(score, 0.0, 1.0),
            outline=boxes[:, [[0, 1], [2, 1], [2, 3], [0, 3]]],
        )

    def _boxes(self, output: FloatArray, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Left, top, right, bottom; score; class."""
        if output.ndim == 3 and output.shape[0] == 1:
            rows = output[0]
            if rows.shape[1] == 6:
                return rows[:, :4], rows[:, 4], rows[:, 5]
            if 5 <= rows.shape[0] <= rows.shape[1]:
                centre, half, scores = rows[:2].T, rows[2:4].T / 2, rows[4:]
                boxes = np.concatenate([centre - half, centre + half], axis=1)
                return boxes, scores.max(axis=0), scores.argmax(axis=0).astype(np.float64)
        raise InputError(
            f"{self._path}: found {count} output(s), the first of shape {output.shape}, "
            "expected (1, N, 6) or (1, 4 + classes, N); export the model with one of them"
        )


def _session(path: Path) -> Any:
    try:
        import onnxruntime  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise InputError("models need onnxruntime; install airground[onnx]") from error
    if not path.is_file():
        raise InputError(f"{path}: no such file; expected an ONNX model")
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    try:
        return onnxruntime.InferenceSession(
            str(path), sess_options=options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # its exceptions share no base but this one
        reason = str(error).splitlines()[0][:200]
        raise InputError(f"{path}: not a model that onnxruntime reads: {reason}") from error


def _letterbox(
    image: ImageArray, size_px: tuple[int, int]
) -> tuple[np.ndarray[Any, np.dtype[np.float32]], FloatArray, FloatArray]:
    """Tensor; by how much u and v were scaled, then shifted."""
    width, height = size_px
    factor = min(width / image.shape[1], height / image.shape[0])
    inner = (max(1, round(image.shape[1] * factor)), max(1, round(image.shape[0] * factor)))
    small = cv2.resize(image, inner, interpolation=cv2.INTER_LINEAR)
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    sheet = np.full((height, width, 3), GREY, dtype=np.uint8)
    sheet[top : top + inner[1], left : left + inner[0]] = small
    tensor = np.ascontiguousarray(sheet[:, :, ::-1].transpose(2, 0, 1)[None], dtype=np.float32)
    scale = np.array([inner[0] / image.shape[1], inner[1] / image.shape[0]] * 2)
    return tensor / np.float32(255.0), scale, np.array([left, top], dtype=np.float64)


def _best(boxes: FloatArray, score: FloatArray, kind: FloatArray, overlap: float) -> list[int]:
    """Rows of boxes that no better one of their class covers, the best first."""
    kept: list[int] = []
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    for row in np.argsort(-score, kind="stable"):
        others = np.array([k for k in kept if kind[k] == kind[row]], dtype=np.intp)
        low = np.maximum(boxes[others, :2], boxes[row, :2])
        high = np.minimum(boxes[others, 2:], boxes[row, 2:])
        common = np.prod(np.clip(high - low, 0, None), axis=1)
        union = area[others] + area[row] - common
        if not (common > overlap * union).any():
            kept.append(int(row))
    return kept
