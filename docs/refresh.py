"""Refresh what the docs quote from the program: the command line's help, and the demo's picture.

Run: make docs
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
COMMANDS = (
    "",
    "demo",
    "serve",
    "track",
    "identify",
    "calibrate",
    "inspect",
    "speed",
    "drive",
    "record",
    "replay",
    "reproduce",
)


def main() -> None:
    """Write docs/cli.md and docs/images."""
    pages = ["# Command line", "", "Pasted by `make docs`; edit the program, not this page.", ""]
    environment = {**os.environ, "COLUMNS": "110"}
    for command in COMMANDS:
        words = ["airground", *([command] if command else []), "--help"]
        done = subprocess.run(
            [sys.executable, "-m", *words],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        )
        pages += [
            f"## {' '.join(words[:-1])}",
            "",
            "```",
            f"$ {' '.join(words)}",
            done.stdout.rstrip(),
            "```",
            "",
        ]
    (DOCS / "cli.md").write_text("\n".join(pages), encoding="utf-8")

    images = DOCS / "images"
    images.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([sys.executable, "-m", "airground", "demo", "--out", name], check=True)
        for picture in ("overview.png", "view.png", "frame.png", "drive.png", "drive-frame.png"):
            shutil.copy(Path(name) / picture, images / f"demo-{picture}")
        subprocess.run([sys.executable, "-m", "airground", "reproduce", "--out", name], check=True)
        for picture in ("fig4.png", "fig5.png", "fig8.png", "fig9.png", "fig10.png", "fig11.png"):
            shutil.copy(Path(name) / picture, images / picture)
        if (Path(name) / "real.png").exists():  # recordings are at hand: AIRGROUND_DATA names them
            shutil.copy(Path(name) / "real.png", images / "real.png")


if __name__ == "__main__":
    main()
