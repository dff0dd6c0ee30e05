"""``python -m drake_tracker`` is ``drake-tracker``."""

import sys

from drake_tracker.cli import main

if __name__ == "__main__":
    sys.exit(main())
