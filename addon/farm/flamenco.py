"""Flamenco 3: a room as a job of the type `scan_relight.js`, handed to the manager over its HTTP interface."""

import json
import platform
import urllib.error
import urllib.parse
import urllib.request
from http.client import HTTPException
from pathlib import Path
from typing import Any

from ..core.errors import BadInputError
from ..core.kinds import Code, Shown
from .plan import PROGRAM, Room

SCRIPT = Path(__file__).parent / "scan_relight.js"
JOB_TYPE: Code[str] = "scan-relight"
"""What the manager makes of the script's name."""
MANAGER: Code[str] = "http://localhost:8080/"
TIMEOUT: Shown[float] = 30.0
"""How long the manager may take for an answer."""
PATHS = ("mesh", "exposures", "segments", "override")
MAX_ANSWER_BYTES: Shown[int] = 1 << 24
"""Bytes of an answer that are read."""
NO_MANAGER = "What answers at {} is no manager of Flamenco 3; check --manager."


def _send(address: str, path: str, content: dict[str, Any] | None = None) -> Any:
    """Send a request to the manager and return its answer, parsed JSON; raises LookupError on status 404."""
    data = None if content is None else json.dumps(content).encode()
    headers = {"Content-Type": "application/json", "Accept": "application/json"}
    try:
        if urllib.parse.urlsplit(address).scheme not in ("http", "https"):
            raise BadInputError(f"'{address}' is no manager's address; give --manager as {MANAGER}.")
        request = urllib.request.Request(urllib.parse.urljoin(address.rstrip("/") + "/", path), data, headers)
        with urllib.request.urlopen(request, timeout=TIMEOUT) as answer:
            return json.loads(answer.read(MAX_ANSWER_BYTES))
    except urllib.error.HTTPError as error:
        with error:
            message = _message(error.read(MAX_ANSWER_BYTES))
        if error.code == 404:
            raise LookupError(message) from error
        raise BadInputError(f"Flamenco's manager at {address} refused ({error.code}): {message}.") from error
    except OSError as error:
        reason = getattr(error, "reason", error)
        raise BadInputError(f"Flamenco's manager at {address} can't be reached ({reason}).") from error
    except (ValueError, HTTPException) as error:
        raise BadInputError(NO_MANAGER.format(address)) from error


def _message(content: bytes) -> str:
    try:
        return str(json.loads(content)["message"]).rstrip(". ")
    except (ValueError, KeyError, TypeError):
        return "no reason given"


def job_of(room: Room, etag: str = "", priority: int = 50) -> dict[str, Any]:
    """The room as a `SubmittedJob`."""
    settings: dict[str, Any] = {"capture": str(room.capture), "result": str(room.result)}
    settings["blocks"] = room.blocks if room.divided else 1
    options = []
    for option in room.options:
        name, _, value = option.removeprefix("--").partition("=")
        if name in PATHS:
            settings[name] = value
        else:
            options.append(option)
    settings["options"] = json.dumps(options)
    if room.program != (PROGRAM,):
        settings["program"], settings["program_args"] = room.program[0], json.dumps(list(room.program[1:]))
    job = {"name": room.name, "type": JOB_TYPE, "priority": priority, "settings": settings}
    job |= {"metadata": {"project": "Scan Relight"}, "submitter_platform": platform.system().lower()}
    return job | ({"type_etag": etag} if etag else {})


def submit(room: Room, address: str = "", priority: int = 50) -> str:
    """Hand a room to the manager at an address; returns the job's number. Raises `BadInputError`."""
    address = address or MANAGER
    try:
        known = _send(address, f"api/v3/jobs/type/{JOB_TYPE}")
    except LookupError as error:
        raise BadInputError(
            f"Flamenco's manager at {address} has no job type '{JOB_TYPE}'; put {SCRIPT} into its folder "
            "'scripts' and start it anew."
        ) from error
    etag = str(known.get("etag", "")) if isinstance(known, dict) else ""
    try:
        return str(_send(address, "api/v3/jobs", job_of(room, etag, priority))["id"])
    except (LookupError, TypeError) as error:
        raise BadInputError(NO_MANAGER.format(address)) from error
