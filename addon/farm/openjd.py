"""Open Job Description: a room as a job template, which Deadline Cloud and others run; `openjd run` does it here."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .plan import Room

TEMPLATE = "openjd.json"


def template(room: Room, divided: tuple[str, ...]) -> dict[str, Any]:
    """The room as a template of the specification 2023-09; a step for each stage, its blocks as tasks of a step."""
    steps: list[dict[str, Any]] = []
    names: dict[str, str] = {}
    for task in room.tasks(divided):
        name = names[task.name] = f"{task.stage} blocks" if task.block else task.stage
        if steps and steps[-1]["name"] == name:
            continue
        words = room.command(task.stage, "{{Task.Param.Block}}/{{Param.Blocks}}" if task.block else "")
        # The folders are the job's parameters, so that a farm may map their paths.
        known = {str(room.capture): "{{Param.Capture}}", str(room.result): "{{Param.Result}}"}
        words = [known.get(word, word if "{{" in word and task.block else _plain(word)) for word in words]
        step: dict[str, Any] = {"name": name}
        if after := list(dict.fromkeys(names[one] for one in task.after)):
            step["dependencies"] = [{"dependsOn": one} for one in after]
        if task.block:
            blocks = {"name": "Block", "type": "INT", "range": "1-{{Param.Blocks}}"}
            step["parameterSpace"] = {"taskParameterDefinitions": [blocks]}
        run = {"command": words[0], "args": words[1:]}
        steps.append(step | {"script": {"actions": {"onRun": run}}})
    folders = [
        {"name": name, "type": "PATH", "objectType": "DIRECTORY", "dataFlow": flow, "default": str(path)}
        for name, flow, path in (("Capture", "IN", room.capture), ("Result", "INOUT", room.result))
    ]
    blocks = {"name": "Blocks", "type": "INT", "minValue": 1, "default": room.blocks}
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"Scan Relight: {room.name}"[:128],
        "parameterDefinitions": [*folders, blocks],
        "steps": steps,
    }


def _plain(word: str) -> str:
    """A word that holds what a template would take for its own: there is no way to quote that."""
    return word.replace("{{", "{ {").replace("}}", "} }")


def write(room: Room, divided: tuple[str, ...]) -> Path:
    """Write the room's template into its farm folder. Raises `StorageError`."""
    return room.write(TEMPLATE, json.dumps(template(room, divided), indent=1, ensure_ascii=False) + "\n")
