from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pytest

from airground.errors import InputError, UnreachableError
from airground.sim3d.backend import drawn_by, load_mujoco, make_renderer
from airground.sim3d.world import World3d

BOX = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"


def test_without_mujoco_a_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(
        InputError, match=r"MuJoCo is not installed: pip install airground\[sim3d\]"
    ):
        World3d()


def test_nothing_of_mujoco_is_imported_before_a_world_is_built() -> None:
    code = "import sys, airground.sim3d; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_where_it_cannot_draw_a_line_says_what_to_set_and_to_install(
    physics: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    mujoco = load_mujoco()

    def refuse(*_: Any) -> None:
        raise RuntimeError("no display\nand more")

    monkeypatch.setattr(mujoco, "Renderer", refuse)
    with pytest.raises(UnreachableError) as caught:
        make_renderer(mujoco.MjModel.from_xml_string(BOX), (32, 32))
    line = str(caught.value)
    assert "\n" not in line
    assert all(word in line for word in ("no display", "MUJOCO_GL", "libegl1", "libosmesa6"))


CANNOT = """
from airground.errors import UnreachableError
from airground.sim3d.backend import load_mujoco, make_renderer
try:
    make_renderer(load_mujoco().MjModel.from_xml_string({box!r}), (32, 32))
except UnreachableError as error:
    print(error)
"""


@pytest.mark.parametrize("way", ["nonsense", "disable"])
def test_a_way_of_drawing_that_does_not_work_is_named(way: str, physics: None) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CANNOT.format(box=BOX)],
        env=os.environ | {"MUJOCO_GL": way},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert f"MUJOCO_GL={way}" in done.stdout


def test_it_says_how_it_draws(drawing: None) -> None:
    assert drawn_by().startswith("MuJoCo draws by ")
    assert sys.platform != "linux" or os.environ["MUJOCO_GL"] in drawn_by()
