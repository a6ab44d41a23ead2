"""One sighting of one robot: the same algebra as for a frame of many, written for the least overhead.

NumPy's calls on batches of one cost several times the work in them; a robot alone is what most people have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.calibration.online_rows import GATE, HUBER

if TYPE_CHECKING:
    from airground.calibration.online_rows import Frame, RobotRows
    from airground.geometry.arrays import FloatArray

__all__ = ["One", "follow_one"]

SMALLEST = 1e-300


class One(NamedTuple):
    """What one sighting says about the globals."""

    A: FloatArray
    """(2, K). Derivative of the sighting by the globals, the robot's state following."""

    AtV: FloatArray
    """(K, 2). Its transpose over the covariance that a sighting has given the globals, times the weight."""

    CA: FloatArray
    """(K, 2). Globals' covariance times A transposed."""

    N: FloatArray
    """(2, 2). Covariance of the innovation."""

    gain: FloatArray
    """(2, 2). Inverse of the innovation's covariance, with the weight as so much more noise."""

    r: FloatArray
    """(2,). Innovation; 0 if it was refused."""

    innovation: FloatArray
    """(1, 2). Before that was decided."""

    nis: FloatArray
    """(1,). Normalised innovation squared."""

    weight: FloatArray
    """(1,). What it counts."""


def follow_one(  # noqa: PLR0915
    rows: RobotRows, x: FloatArray, frame: Frame, C: FloatArray, *, held: bool
) -> One:
    """Predict a robot by its readings and correct it by its sighting.

    Parameters
    ----------
    rows : RobotRows
        States, two numbers wide; the robot's is brought up to date.
    x : (K,) array
        Globals.
    frame : Frame
        With one row.
    C : (K, K) array
        Covariance of the globals, for the gate.
    held : bool
        Whether the globals stay where they are.

    Returns
    -------
    one : One
        For the globals.
    """
    k = int(frame.robots[0])
    slope = rows.slope[k]
    mean = rows.mean[k]
    if not held:
        mean = mean + slope.dot(x - rows.at[k])
    path = frame.path[0]
    px, py, vx, vy, qxx, qxy, qyy, _ = path.tolist()
    _, _, _, _, bxx, bxy, byy, _ = rows.before[k].tolist()
    (s00, s01), (_, s11) = rows.S[k].tolist()
    s00 += qxx - bxx
    s01 += qxy - bxy
    s11 += qyy - byy
    a, b, c, d, e, f = x[:6].tolist()
    mx, my = mean.tolist()
    X, Y = mx + px, my + py
    det = a * d - b * c
    z = e * X + f * Y + 1.0 / det
    over = 1.0 / (z or SMALLEST)
    u, v = (a * X + b * Y) * over, (c * X + d * Y) * over
    lift = over / (det * det)
    ul, vl, xo, yo = u * lift, v * lift, X * over, Y * over
    h00, h01 = (a - u * e) * over, (b - u * f) * over
    h10, h11 = (c - v * e) * over, (d - v * f) * over
    H = np.array([[h00, h01], [h10, h11]])
    A = H.dot(slope)
    A[:, :6] += np.array(
        [
            [ul * d + xo, -ul * c + yo, -ul * b, ul * a, -u * xo, -u * yo],
            [vl * d, -vl * c, -vl * b + xo, vl * a + yo, -v * xo, -v * yo],
        ]
    )
    if len(x) == 7:
        A[0, 6] += h00 * vx + h01 * vy
        A[1, 6] += h10 * vx + h11 * vy
    # S H' and W = H S H' + R
    t00, t01 = s00 * h00 + s01 * h01, s00 * h10 + s01 * h11
    t10, t11 = s01 * h00 + s11 * h01, s01 * h10 + s11 * h11
    noise = float(frame.variance[0])
    w00, w01, w11 = h00 * t00 + h01 * t10 + noise, h00 * t01 + h01 * t11, h10 * t01 + h11 * t11
    w11 += noise
    CA = C.dot(A.T)
    (n00, n01), (_, n11) = A.dot(CA).tolist()
    m00, m01, m11 = w00 + n00, w01 + n01, w11 + n11
    (su, sv) = frame.c[0].tolist()
    ru, rv = su - u, sv - v
    innovation = np.array([[ru, rv]])
    nis = (ru * ru * m11 - 2 * ru * rv * m01 + rv * rv * m00) / (m00 * m11 - m01 * m01)
    if not (nis < GATE and z * det > 0):
        weight = ru = rv = 0.0
        gain = V = np.zeros((2, 2))
    else:
        weight = 1.0 if nis <= HUBER else (HUBER / nis) ** 0.5
        share = weight / (w00 * w11 - w01 * w01)
        v00, v01, v11 = w11 * share, -w01 * share, w00 * share
        V = np.array([[v00, v01], [v01, v11]])
        g00, g01, g11 = w00 / weight + n00, w01 / weight + n01, w11 / weight + n11
        share = 1.0 / (g00 * g11 - g01 * g01)
        gain = np.array([[g11 * share, -g01 * share], [-g01 * share, g00 * share]])
        k00, k01 = t00 * v00 + t01 * v01, t00 * v01 + t01 * v11
        k10, k11 = t10 * v00 + t11 * v01, t10 * v01 + t11 * v11
        rows.slope[k] = slope - np.array([[k00, k01], [k10, k11]]).dot(A)
        mx += k00 * ru + k01 * rv
        my += k10 * ru + k11 * rv
        s00 -= k00 * t00 + k01 * t01
        s01 -= k00 * t10 + k01 * t11
        s11 -= k10 * t10 + k11 * t11
    rows.mean[k] = (mx, my)
    rows.S[k] = ((s00, s01), (s01, s11))
    rows.before[k] = path
    rows.at[k] = x
    return One(
        A,
        A.T.dot(V),
        CA,
        np.array([[m00, m01], [m01, m11]]),
        gain,
        np.array([ru, rv]),
        innovation,
        np.array([nis]),
        np.array([weight]),
    )
