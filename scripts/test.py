"""One command for the tests: makes or completes `.venv` with the test tools and runs pytest in it.

    python3.11 scripts/test.py [--quick] [what pytest takes, such as tests/core or -k name]

`--quick` leaves out what is marked `slow` or `hard_case`, and the window, and shares the rest among all cores: under 3
minutes on two.
"""

from __future__ import annotations

import sys

from environment import hand_over, prepare

QUICK = ["-m", "not slow and not hard_case", "--ignore=tests/window", "-n", "auto", "--dist", "loadfile"]

if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--quick"]
    chosen = QUICK if "--quick" in sys.argv else []
    sys.exit(hand_over([str(prepare(tools=True)), "-m", "pytest", *chosen, *words]))
