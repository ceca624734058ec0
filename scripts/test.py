"""One command for the tests: makes or completes `.venv` with the test tools and runs pytest in it.

python3.11 scripts/test.py [what pytest takes, such as tests/core or -k name]
"""

from __future__ import annotations

import sys

from environment import hand_over, prepare

if __name__ == "__main__":
    sys.exit(hand_over([str(prepare(tools=True)), "-m", "pytest", *sys.argv[1:]]))
