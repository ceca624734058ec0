"""Open Job Description: a room as a job template, which Deadline Cloud and others run; `openjd run` runs it locally."""

from pathlib import Path
from typing import Any

from ..core.errors import BadInputError
from .plan import Room

TEMPLATE, PARAMETERS = "openjd.json", "openjd-parameters.json"


def template(room: Room) -> dict[str, Any]:
    """The room as a template of the specification 2023-09; a step for each stage, its blocks as tasks of a step."""
    steps: list[dict[str, Any]] = []
    names: dict[str, str] = {}
    for task in room.tasks():
        name = names[task.name] = f"{task.stage} blocks" if task.block else task.stage
        if steps and steps[-1]["name"] == name:
            continue
        words = room.command(task.stage, "{{Task.Param.Block}}/{{Param.Blocks}}" if task.block else "")
        # The folders are the job's parameters, so that a farm may map their paths.
        known = {str(room.capture): "{{Param.Capture}}", str(room.result): "{{Param.Result}}"}
        for word in room.command(task.stage):
            if "{{" in word and word not in known:
                raise BadInputError(
                    f"Open Job Description would take '{word}' for its own; there is no way to quote it."
                )
        words = [known.get(word, word) for word in words]
        step: dict[str, Any] = {"name": name}
        if after := list(dict.fromkeys(names[name] for name in task.after)):
            step["dependencies"] = [{"dependsOn": dependency} for dependency in after]
        if task.block:
            blocks = {"name": "Block", "type": "INT", "range": "1-{{Param.Blocks}}"}
            step["parameterSpace"] = {"taskParameterDefinitions": [blocks]}
        run = {"command": words[0], "args": words[1:]}
        steps.append(step | {"script": {"actions": {"onRun": run}}})
    # Without defaults: only paths below the template's folder may be those.
    folders = [
        {"name": name, "type": "PATH", "objectType": "DIRECTORY", "dataFlow": flow}
        for name, flow in (("Capture", "IN"), ("Result", "INOUT"))
    ]
    blocks = {"name": "Blocks", "type": "INT", "minValue": 1, "default": room.blocks}
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"Scan Relight: {room.name}"[:128],
        "parameterDefinitions": [*folders, blocks],
        "steps": steps,
    }


def write(room: Room) -> Path:
    """Write the room's template and its parameters' values into its farm folder; raises `StorageError`."""
    room.write(PARAMETERS, {"Capture": str(room.capture), "Result": str(room.result), "Blocks": room.blocks})
    return room.write(TEMPLATE, template(room))
