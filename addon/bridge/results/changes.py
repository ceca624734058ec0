"""Findings of a run for each object compared with those of the last run, so that an artist sees what changed."""

import json
import math
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf.material import renamed
from ...core.kinds import Shown
from ...core.results.room_file import DAMAGE, MATERIALS
from ..custom_properties import CHANGES, LAST_FOUND

ROUGHNESS: Shown[float] = 0.1
ALBEDO: Shown[float] = 0.05
"""Visible differences: of Blender's roughness, and of the mean albedo."""


def read_findings(folder: Path) -> dict[str, dict[str, Any]]:
    """A result's findings for each object, by `object_id`; empty where it can't be read."""
    try:
        entries = json.loads((folder / MATERIALS).read_text(encoding="utf-8"))["objects"]
        return {str(entry["object_id"]): _finding(renamed(entry)) for entry in entries}
    except DAMAGE:
        return {}


def _finding(entry: dict) -> dict[str, Any]:
    albedo = (entry.get("evidence") or {}).get("albedo")
    alpha = entry.get("alpha")
    return {
        "name": entry.get("name") or f"{entry.get('class_name') or 'Object'} {entry['object_id']}",
        "model": entry["model"],
        "roughness": None if alpha is None else round(math.sqrt(max(alpha, 0.0)), 3),
        "albedo": None if albedo is None else round(sum(albedo) / 3, 3),
    }


def store_findings(collection: bpy.types.Collection, findings: dict[str, dict[str, Any]]) -> None:
    """Store findings in the room's collection."""
    collection[LAST_FOUND] = json.dumps(findings)


def compare(before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """The objects with visible differences, the greatest first."""
    changes = []
    for key in (key for key in after if key in before):
        old, new = before[key], after[key]
        rank, sentences = 0.0, []
        if old["model"] != new["model"]:
            rank, sentences = 10.0, [f"{old['model']}, now {new['model']}"]
        for name, threshold in (("roughness", ROUGHNESS), ("albedo", ALBEDO)):
            if None not in (old[name], new[name]) and abs(new[name] - old[name]) >= threshold:
                rank += abs(new[name] - old[name]) / threshold
                sentences.append(f"{name} {old[name]:.2f}, now {new[name]:.2f}")
        if sentences:
            text = f"{new['name']}: {'; '.join(sentences)}."
            changes.append((-rank, {"object_id": int(key), "name": new["name"], "text": text}))
    return tuple(change for _, change in sorted(changes, key=lambda pair: pair[0]))


def stored_findings(collection: bpy.types.Collection) -> dict[str, dict[str, Any]]:
    """The findings of the room's last run; empty where it had none."""
    return json.loads(collection.get(LAST_FOUND, "{}"))


def store_changes(scene: bpy.types.Scene, changes: tuple[dict[str, Any], ...]) -> None:
    """Store the differences in a scene, for its panel."""
    scene[CHANGES] = json.dumps(changes)


def stored_changes(scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """The differences that are stored in a scene."""
    try:
        return json.loads(scene.get(CHANGES, "[]"))
    except ValueError:
        return []
