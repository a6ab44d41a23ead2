"""A place where permissions bind, even for root in a container."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

NOBODY = 65534


@pytest.fixture
def own_folder() -> Iterator[Path]:
    """Folder of a user who is not root: root takes that user's place for the test.

    If root does, the folder holds a file of root's, theirs.csv, that the user may only read.
    """
    if not hasattr(os, "geteuid"):
        pytest.skip("needs the permissions of POSIX")
    folder = Path(tempfile.mkdtemp())  # pytest's own lie below a folder closed to others
    root = os.geteuid() == 0
    if root:
        (folder / "theirs.csv").write_bytes(b"old")
        (folder / "theirs.csv").chmod(0o644)
        os.chown(folder, NOBODY, -1)
        os.seteuid(NOBODY)
    try:
        yield folder
    finally:
        if root:
            os.seteuid(0)
        folder.chmod(0o700)
        shutil.rmtree(folder)
