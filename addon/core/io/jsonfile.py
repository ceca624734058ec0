"""JSON as captures bring it, read with care."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from .paths import absence


def read_json(path: Path) -> dict[str, Any]:
    """The object in the file `path`; raises `BadInputError` where it is absent, not JSON, or no object."""
    try:
        if what := absence(path):
            raise BadInputError(f"'{path}' {what}; check the capture.")
        value = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise BadInputError(f"'{path}' can't be read ({error.strerror or error}); check the capture.") from error
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"'{path}' is not valid JSON ({error}); export it again.") from error
    if not isinstance(value, dict):
        raise BadInputError(f"'{path}' holds no JSON object; export it again.")
    return value
