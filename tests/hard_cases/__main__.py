"""`python -m tests.hard_cases [FILE]`: run the hard cases and print (or write) the table of what they measured."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.hard_cases.figures import table

if __name__ == "__main__":
    code = pytest.main([str(Path(__file__).parent), "-q", "-p", "no:cacheprovider"])
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(table(), encoding="utf-8")
    else:
        print(table())
    sys.exit(code)
