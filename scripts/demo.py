"""One command for a newcomer: makes `.venv`, installs Scan Relight into it, and runs its demo into demo-result/.

python3.11 scripts/demo.py [what `scan-relight demo` takes, such as --size large]
"""

from __future__ import annotations

import sys

from environment import ROOT, hand_over, prepare, program

if __name__ == "__main__":
    prepare()
    options = sys.argv[1:]
    out = [] if any(option.split("=")[0] == "--out" for option in options) else ["--out", "demo-result"]
    sys.exit(hand_over([str(program(ROOT / ".venv", "scan-relight")), "demo", *out, *options]))
