"""What a result folder says of its objects, for the panel: read when a file changed, kept in memory, never saved."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ..addon.bridge import look
from . import preferences

MATERIALS, REPORT, PAGE = "materials.json", "report.json", "report.html"
SURE, FAIR = 0.15, 0.4
"""Doubt (`doubt`) up to which an object counts as sure, and as fairly sure."""


@dataclass(frozen=True)
class Result:
    """A result folder's content; empty where a file is absent or damaged.

    Attributes
    ----------
    folder : Path
    objects : dict of int to dict
        Entries of materials.json by `object_id`.
    stages : dict of str to dict
        Of report.json.
    figures : dict
        Of report.json.
    """

    folder: Path
    objects: dict[int, dict[str, Any]]
    stages: dict[str, dict[str, Any]]
    figures: dict[str, Any]


_read: dict[Path, tuple[tuple, Result]] = {}


def folder_of(scene: bpy.types.Scene) -> Path | None:
    """The result folder that a scene's panel is about: the chosen one, or that of its recovered objects."""
    choices = scene.scan_relight
    if choices.result_folder:
        return Path(bpy.path.abspath(choices.result_folder))
    if choices.capture_folder:
        folder = preferences.result_folder("", choices.capture_folder)
        if (folder / MATERIALS).is_file():
            return folder
    return look.result_of(scene)


def result_of(scene: bpy.types.Scene) -> Result | None:
    """What is known of a scene's result; None where there is none."""
    folder = folder_of(scene)
    if folder is None:
        return None
    stamp = tuple(_stamp(folder / name) for name in (MATERIALS, REPORT))
    if not any(stamp):
        return None
    if folder not in _read or _read[folder][0] != stamp:
        if len(_read) > 8:
            _read.clear()
        report = _json(folder / REPORT)
        listed = _json(folder / MATERIALS).get("objects")
        objects = {one["object_id"]: one for one in listed if isinstance(one, dict) and "object_id" in one} \
            if isinstance(listed, list) else {}
        _read[folder] = stamp, Result(folder, objects, *(
            report[key] if isinstance(report.get(key), dict) else {} for key in ("stages", "figures")))
    return _read[folder][1]


def forget() -> None:
    """Read everything again."""
    _read.clear()


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size


def _json(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return value if isinstance(value, dict) else {}


def doubt(one: dict[str, Any]) -> float | None:
    """How unsure an object's material is, 0...1: the greater of two widths of 90 % intervals.

    That of its roughness where it has a highlight, and half of that of its albedo, relative to it, where it has one.
    None where nothing is known of either.
    """
    found = []
    low, high = one.get("roughness_low"), one.get("roughness_high")
    if one.get("model") in ("specular", "metal") and None not in (low, high):
        found.append(high - low)
    evidence = one.get("evidence") or {}
    if one.get("model") in ("lambertian", "specular"):
        mean, low, high = (_mean(evidence.get(key)) for key in ("albedo", "albedo_low", "albedo_high"))
        if None not in (mean, low, high):
            found.append((high - low) / 2 / max(mean, 1e-3))
    return min(max(found), 1.0) if found else None


def certainty(one: dict[str, Any]) -> str:
    """`doubt` in a word."""
    value = doubt(one)
    if value is None:
        return "unknown"
    return "sure" if value <= SURE else "fair" if value <= FAIR else "unsure"


def specular(one: dict[str, Any]) -> float | None:
    """An object's reflectance at normal incidence; a metal's is the mean of its colours'."""
    return one["psi"] if one.get("psi") is not None else _mean(one.get("f0"))


def _mean(value) -> float | None:
    if isinstance(value, (list, tuple)) and value and all(isinstance(one, (int, float)) for one in value):
        return sum(value) / len(value)
    return float(value) if isinstance(value, (int, float)) else None


def facts(one: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and text of everything that the panel tells of an object."""
    model, evidence = one.get("model", ""), one.get("evidence") or {}
    found = [("Model", {"lambertian": "Lambertian (matt)", "specular": "Specular", "metal": "Metal",
                        "emitter": "Lamp", "transparent": "Transparent"}.get(model, model))]
    phi = one.get("phi")
    if phi is not None:
        found.append(("Roughness", _between(max(phi, 0) ** 0.5, one.get("roughness_low"), one.get("roughness_high"))))
    value = specular(one)
    if value is not None:
        found.append(("Specular F0", _between(value, one.get("specular_low"), one.get("specular_high"))))
    if model == "emitter" and one.get("emission") is not None:
        found.append(("Radiance", ", ".join(f"{part:.3g}" for part in one["emission"])))
    albedo = _mean(evidence.get("albedo"))
    if albedo is not None and model != "emitter":
        found.append(("Albedo", _between(albedo, *(_mean(evidence.get(k)) for k in ("albedo_low", "albedo_high")))))
    if evidence.get("seen_share") is not None:
        found.append(("Seen", f"{evidence['seen_share']:.0%} of {evidence.get('area', 0):.3g} m\u00b2"))
    if evidence.get("observations") is not None:
        found.append(("Views", f"{evidence['observations']:.0f}"))
    return [*found, ("Certainty", certainty(one).capitalize())]


def _between(value: float, low: float | None, high: float | None) -> str:
    return f"{value:.2f}" if None in (low, high) else f"{value:.2f}  ({low:.2f} to {high:.2f})"
