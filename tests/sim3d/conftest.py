"""Skips where MuJoCo is missing or cannot draw, and says why."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from airground.errors import UnreachableError
from airground.sim3d.backend import load_mujoco, make_renderer

BOX = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"


@pytest.fixture(scope="session")
def physics() -> None:
    """MuJoCo is there."""
    if find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed: pip install airground[sim3d]")


@pytest.fixture(scope="session")
def drawing(physics: None) -> None:
    """And it can draw."""
    try:
        make_renderer(load_mujoco().MjModel.from_xml_string(BOX), (64, 48)).close()
    except UnreachableError as error:
        pytest.skip(str(error))
