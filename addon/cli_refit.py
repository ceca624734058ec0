"""What the command line knows of corrections: the options for them, and the command `refit`."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_override(parser: argparse.ArgumentParser) -> None:
    """The options by which a run is given what is known of objects."""
    parser.add_argument("--override", metavar="FILE", type=Path,
                        help="JSON of what is known of objects; merged into RESULT/overrides.json, which runs heed")
    parser.add_argument("--no-overrides", action="store_true", help="don't heed what RESULT/overrides.json keeps")
