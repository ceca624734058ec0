"""What a result folder says of its objects, for the panel: read when a file changed, kept in memory, never saved."""

from collections import Counter
from pathlib import Path
from typing import Any

import bpy

from ...addon.bridge.results import file, look
from ...addon.bridge.results.file import EARLIER, FITS, MATERIALS, UNKNOWN, Result, result_state, result_states
from ...addon.core.brdf.registry import find, shown
from ...addon.core.kinds import Shown
from .. import preferences

PAGE = "report.html"
SURE: Shown[float] = 0.15
FAIR: Shown[float] = 0.4
"""Interval width up to which an object counts as sure, and as fairly sure."""
GIVEN = {"model": "model", "roughness": "roughness", "f0": "F0", "base_color": "colour", "same_as": "same as object"}


def folder_of(scene: bpy.types.Scene) -> Path | None:
    """The result folder that a scene's panel is about: the active object's, else the chosen one, else the room's."""
    state, result = result_state(active(scene))
    if state == FITS:
        return result.folder
    choices = scene.scan_relight
    if choices.result_folder:
        return Path(bpy.path.abspath(choices.result_folder))
    folder = preferences.chosen_result(scene)
    if folder is not None and (folder / MATERIALS).is_file():
        return folder
    return look.result_of(scene)


def active(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The active object of the window's view of a scene."""
    return bpy.context.view_layer.objects.active if bpy.context.scene == scene and bpy.context.view_layer else None


def result_of(scene: bpy.types.Scene) -> Result | None:
    """What is known of a scene's result; None where there is none."""
    folder = folder_of(scene)
    return None if folder is None else file.read(folder)


def refused(things) -> list[tuple[str, Path | None]]:
    """What is said of objects whose values can't be shown, as their folder holds another run or nobody can tell.

    Those whose folder is gone are told by the panel's top (`find_result`).

    Returns
    -------
    list of (str, Path or None)
        A sentence, and the folder whose run has to be brought in; None where nobody can tell.
    """
    states = [(state, result) for state, result in result_states(things).values() if state in (EARLIER, UNKNOWN)]
    counts = Counter(result.folder if state == EARLIER else None for state, result in states)
    return [
        (
            f"{count} object{'s' * (count > 1)} of this scene {'are' if count > 1 else 'is'} "
            + (
                f"of an earlier run than the one that lies in '{folder.name}' now; bring in the new one to see what "
                "was found."
                if folder
                else "of an older version of Scan Relight, so that nobody can tell which run made them; run again and "
                "bring in the result."
            ),
            folder,
        )
        for folder, count in counts.items()
    ]


def label(model: str) -> str:
    """What the panel calls a model."""
    brdf = find(model)
    return brdf.label if brdf else model


def interval_width(one: dict[str, Any]) -> float | None:
    """How unsure an object's material is, 0...1: by its roughness, or half by its relative albedo; None if unknown."""
    found = []
    low, high = one.get("roughness_low"), one.get("roughness_high")
    brdf = shown(one.get("model"))
    if brdf.has_lobe and None not in (low, high):
        found.append(high - low)
    evidence = one.get("evidence") or {}
    if brdf.has_albedo:
        mean, low, high = (_mean(evidence.get(key)) for key in ("albedo", "albedo_low", "albedo_high"))
        if None not in (mean, low, high):
            found.append((high - low) / 2 / max(mean, 1e-3))
    return min(max(found), 1.0) if found else None


def certainty(one: dict[str, Any]) -> str:
    """`interval_width` in a word."""
    value = interval_width(one)
    if value is None:
        return "unknown"
    return "sure" if value <= SURE else "fair" if value <= FAIR else "unsure"


def specular(one: dict[str, Any]) -> float | None:
    """An object's reflectance at normal incidence; a metal's is the mean of its colours'."""
    return _mean(one.get("f0"))


def _mean(value) -> float | None:
    if isinstance(value, (list, tuple)) and value and all(isinstance(one, (int, float)) for one in value):
        return sum(value) / len(value)
    return float(value) if isinstance(value, (int, float)) else None


def facts(one: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and text of everything that the panel tells of an object."""
    name, evidence = one.get("model", ""), one.get("evidence") or {}
    brdf = shown(name)
    found = [("Model", label(name))]
    alpha = one.get("alpha")
    if alpha is not None:
        found.append(("Roughness", _between(max(alpha, 0) ** 0.5, one.get("roughness_low"), one.get("roughness_high"))))
    value = specular(one)
    if value is not None:
        found.append(("Specular F0", _between(value, one.get("f0_low"), one.get("f0_high"))))
    if brdf.gives_light and one.get("emission") is not None:
        found.append(("Radiance", ", ".join(f"{part:.3g}" for part in one["emission"])))
    albedo = _mean(evidence.get("albedo"))
    if albedo is not None and not brdf.gives_light:
        found.append(("Albedo", _between(albedo, *(_mean(evidence.get(k)) for k in ("albedo_low", "albedo_high")))))
    if evidence.get("seen_share") is not None:
        found.append(("Seen", f"{evidence['seen_share']:.0%} of {evidence.get('area', 0):.3g} m\u00b2"))
    if evidence.get("observations") is not None:
        found.append(("Views", f"{evidence['observations']:.0f}"))
    said = one.get("given")
    if said:
        found.append(("Given", ", ".join(f"{GIVEN.get(key, key)} {_told(value)}" for key, value in said.items())))
    return [*found, ("Certainty", certainty(one).capitalize())]


def _told(value) -> str:
    if isinstance(value, (list, tuple)):
        return " ".join(map(_told, value))
    return f"{value:.2f}" if isinstance(value, float) else label(str(value))


def _between(value: float, low: float | None, high: float | None) -> str:
    return f"{value:.2f}" if None in (low, high) else f"{value:.2f}  ({low:.2f} to {high:.2f})"
