"""What a run found of each object beside what the last one found, so that an artist sees what is new."""

import json
import math
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf.material import renamed
from ...core.kinds import Shown
from ...core.results.room_file import DAMAGE, MATERIALS
from ..marks import CHANGES, LAST_FOUND

ROUGHNESS: Shown[float] = 0.1
ALBEDO: Shown[float] = 0.05
"""Differences from which on they can be seen: of Blender's roughness, and of the mean albedo."""


def found(folder: Path) -> dict[str, dict[str, Any]]:
    """What a result says of each object, by `object_id`; empty where it can't be read."""
    try:
        listed = json.loads((folder / MATERIALS).read_text(encoding="utf-8"))["objects"]
        return {str(one["object_id"]): _facts(renamed(one)) for one in listed}
    except DAMAGE:
        return {}


def _facts(one: dict) -> dict[str, Any]:
    albedo = (one.get("evidence") or {}).get("albedo")
    alpha = one.get("alpha")
    return {
        "name": one.get("name") or f"{one.get('class_name') or 'Object'} {one['object_id']}",
        "model": one["model"],
        "roughness": None if alpha is None else round(math.sqrt(max(alpha, 0.0)), 3),
        "albedo": None if albedo is None else round(sum(albedo) / 3, 3),
    }


def keep(top: bpy.types.Collection, now: dict[str, dict[str, Any]]) -> None:
    """Keep what was found with the room."""
    top[LAST_FOUND] = json.dumps(now)


def compare(before: dict[str, dict[str, Any]], now: dict[str, dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """The objects that differ notably, the greatest differences first."""
    told = []
    for key, new in now.items():
        old = before.get(key)
        if old is None:
            continue
        rank, texts = 0.0, []
        if old["model"] != new["model"]:
            rank, texts = 10.0, [f"{old['model']}, now {new['model']}"]
        for name, least in (("roughness", ROUGHNESS), ("albedo", ALBEDO)):
            if None not in (old[name], new[name]) and abs(new[name] - old[name]) >= least:
                rank += abs(new[name] - old[name]) / least
                texts.append(f"{name} {old[name]:.2f}, now {new[name]:.2f}")
        if texts:
            told.append(
                (-rank, {"object_id": int(key), "name": new["name"], "text": f"{new['name']}: {'; '.join(texts)}."})
            )
    return tuple(one for _, one in sorted(told, key=lambda pair: pair[0]))


def kept(top: bpy.types.Collection) -> dict[str, dict[str, Any]]:
    """What the room's last run found; empty where it had none."""
    return json.loads(top.get(LAST_FOUND, "{}"))


def show(scene: bpy.types.Scene, changes: tuple[dict[str, Any], ...]) -> None:
    """Keep the differences with a scene, for its panel."""
    scene[CHANGES] = json.dumps(changes)


def shown(scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """The differences that are kept with a scene."""
    try:
        return json.loads(scene.get(CHANGES, "[]"))
    except ValueError:
        return []
