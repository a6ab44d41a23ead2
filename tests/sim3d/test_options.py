from __future__ import annotations

from typing import Any

import pytest

from airground.errors import InputError
from airground.sim3d.options import (
    CameraOptions3d,
    Other3d,
    Robot3d,
    RobotOptions3d,
    World3dOptions,
)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (RobotOptions3d, {"wheel_radius_m": 0.0}),
        (RobotOptions3d, {"compass_rad": -0.1}),
        (RobotOptions3d, {"body_m": (0.4, 0.0, 0.1)}),
        (RobotOptions3d, {"tag_height_m": 0.1}),
        (RobotOptions3d, {"turn_rate": "guess"}),
        (RobotOptions3d, {"compass_bias_rad": float("nan")}),
        (Other3d, {"route_m": ((0.0, 0.0),)}),
        (Other3d, {"speed_mps": 0.0}),
        (CameraOptions3d, {"fovy_rad": 3.2}),
        (CameraOptions3d, {"image_size_px": (8, 720)}),
        (CameraOptions3d, {"noise_dark": -1.0}),
        (World3dOptions, {"step_s": 0.02}),
        (World3dOptions, {"robots": (Robot3d(), Robot3d(tag=1))}),
        (World3dOptions, {"robots": (Robot3d(tag=9),)}),
        (World3dOptions, {"robots": (Robot3d(name="a b"),)}),
    ],
)
def test_what_cannot_be_built_is_refused(kind: Any, wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"must|different"):
        kind(**wrong)


def test_all_vehicles_are_listed() -> None:
    assert [one.name for one in World3dOptions().vehicles] == ["red", "cart"]
