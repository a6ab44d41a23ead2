"""``python -m airground`` is ``airground``."""

import sys

from airground.cli import main

if __name__ == "__main__":
    sys.exit(main())
