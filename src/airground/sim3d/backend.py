"""MuJoCo, and the way it draws without a screen."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

from airground.errors import InputError, UnreachableError

__all__ = ["drawn_by", "load_mujoco", "make_renderer"]

WAYS = ("egl", "osmesa")
PATIENCE_S = 60.0
PACKAGES = "libegl1 libopengl0 libgl1-mesa-dri (egl) or libosmesa6 (osmesa)"
PROBE = "import mujoco; c = mujoco.GLContext(16, 16); c.make_current(); c.free()"


def load_mujoco() -> Any:
    """Import MuJoCo, after choosing how it draws: MUJOCO_GL where it is set, else egl, else osmesa.

    MuJoCo reads MUJOCO_GL once, when it is imported, and what fails then cannot be tried again: so each way is tried in
    a process of its own, and the first that works is put into MUJOCO_GL.

    Returns
    -------
    mujoco : module
        Physics work whether or not anything can be drawn.

    Raises
    ------
    InputError
        If it is not installed.
    UnreachableError
        If it cannot be loaded, as where MUJOCO_GL is nothing that it knows.
    """
    if "mujoco" not in sys.modules and not os.environ.get("MUJOCO_GL") and sys.platform == "linux":
        _choose()
    try:
        import mujoco
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise InputError("MuJoCo is not installed: pip install airground[sim3d]") from None
    except (RuntimeError, OSError) as error:
        raise _cannot("be loaded", error) from error
    return mujoco


def drawn_by() -> str:
    """Say how MuJoCo draws.

    Returns
    -------
    line : str
        For a log.
    """
    return f"MuJoCo draws by {os.environ.get('MUJOCO_GL') or 'its own choice'}"


def make_renderer(model: Any, size_px: tuple[int, int]) -> Any:
    """Make a renderer without shadows and reflections.

    Parameters
    ----------
    model : MjModel
        What is drawn.
    size_px : (int, int) [px]
        Width and height.

    Returns
    -------
    renderer : mujoco.Renderer
        To be closed.

    Raises
    ------
    UnreachableError
        If nothing can be drawn here.
    """
    mujoco = load_mujoco()
    try:
        renderer = mujoco.Renderer(model, size_px[1], size_px[0])
    except Exception as error:  # whatever OpenGL's bindings raise, of which there is no list
        raise _cannot("draw", error) from error
    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
        renderer.scene.flags[flag] = 0
    return renderer


def _cannot(what: str, error: Exception) -> UnreachableError:
    way = os.environ.get("MUJOCO_GL") or "not set"
    reason = (str(error) or repr(error)).splitlines()[0]
    return UnreachableError(
        f"MuJoCo cannot {what} (MUJOCO_GL={way}: {reason}); "
        f"install {PACKAGES}, or set MUJOCO_GL to egl or osmesa"
    )


def _choose() -> None:
    for way in WAYS:
        try:
            done = subprocess.run(
                [sys.executable, "-c", PROBE],
                env=os.environ | {"MUJOCO_GL": way},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=PATIENCE_S,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            continue
        if done.returncode == 0:
            os.environ["MUJOCO_GL"] = way
            return
