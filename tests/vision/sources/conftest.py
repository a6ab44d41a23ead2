"""Every test of a decoder runs with both."""

from __future__ import annotations

import pytest

from airground.vision.sources.opening import Backend


@pytest.fixture(params=("opencv", "pyav"))
def backend(request: pytest.FixtureRequest) -> Backend:
    """Both, where PyAV is installed."""
    if request.param == "pyav":
        pytest.importorskip("av", reason="PyAV is not installed")
    return "pyav" if request.param == "pyav" else "opencv"
