"""Facts about the objects of a result folder, for the panel: read when a file changed, kept in memory, never saved."""

from collections import Counter
from pathlib import Path
from typing import Any

import bpy

from ...addon.bridge.results import file, look
from ...addon.bridge.results.file import EARLIER, FITS, MATERIALS, UNKNOWN, Result, result_state, result_states
from ...addon.core.brdf.registry import find, find_or_lambertian
from ...addon.core.kinds import Shown
from .. import preferences

PAGE = "report.html"
SURE: Shown[float] = 0.15
FAIR: Shown[float] = 0.4
"""Maximum interval width of an object that counts as sure, and as fairly sure."""
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
    """The result of a scene; None where there is none."""
    folder = folder_of(scene)
    return None if folder is None else file.read(folder)


def refused(objects) -> list[tuple[str, Path | None]]:
    """Messages on objects whose values can't be shown, as their folder has another run or their run is unknown.

    Those whose folder is missing are in the panel at the top (`find_result`).

    Returns
    -------
    list of (str, Path or None)
        A sentence, and the folder whose run has to be brought in; None where it is unknown.
    """
    states = [(state, result) for state, result in result_states(objects).values() if state in (EARLIER, UNKNOWN)]
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
    """Label of a model in the panel."""
    brdf = find(model)
    return brdf.label if brdf else model


def interval_width(entry: dict[str, Any]) -> float | None:
    """Uncertainty of an object's material, 0...1: of its roughness, or half of its relative albedo; None if unknown."""
    widths = []
    low, high = entry.get("roughness_low"), entry.get("roughness_high")
    brdf = find_or_lambertian(entry.get("model"))
    if brdf.has_lobe and None not in (low, high):
        widths.append(high - low)
    evidence = entry.get("evidence") or {}
    if brdf.has_albedo:
        mean, low, high = (_mean(evidence.get(key)) for key in ("albedo", "albedo_low", "albedo_high"))
        if None not in (mean, low, high):
            widths.append((high - low) / 2 / max(mean, 1e-3))
    return min(max(widths), 1.0) if widths else None


def certainty(entry: dict[str, Any]) -> str:
    """`interval_width` in a word."""
    value = interval_width(entry)
    if value is None:
        return "unknown"
    return "sure" if value <= SURE else "fair" if value <= FAIR else "unsure"


def specular(entry: dict[str, Any]) -> float | None:
    """An object's reflectance at normal incidence; for a metal the mean of its channels."""
    return _mean(entry.get("f0"))


def _mean(value) -> float | None:
    if isinstance(value, (list, tuple)) and value and all(isinstance(item, (int, float)) for item in value):
        return sum(value) / len(value)
    return float(value) if isinstance(value, (int, float)) else None


def facts(entry: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and text of all facts that the panel shows of an object."""
    name, evidence = entry.get("model", ""), entry.get("evidence") or {}
    brdf = find_or_lambertian(name)
    rows = [("Model", label(name))]
    alpha = entry.get("alpha")
    if alpha is not None:
        rows.append(
            ("Roughness", _between(max(alpha, 0) ** 0.5, entry.get("roughness_low"), entry.get("roughness_high")))
        )
    value = specular(entry)
    if value is not None:
        rows.append(("Specular F0", _between(value, entry.get("f0_low"), entry.get("f0_high"))))
    if brdf.gives_light and entry.get("emission") is not None:
        rows.append(("Radiance", ", ".join(f"{channel:.3g}" for channel in entry["emission"])))
    albedo = _mean(evidence.get("albedo"))
    if albedo is not None and not brdf.gives_light:
        rows.append(("Albedo", _between(albedo, *(_mean(evidence.get(k)) for k in ("albedo_low", "albedo_high")))))
    if evidence.get("seen_share") is not None:
        rows.append(("Seen", f"{evidence['seen_share']:.0%} of {evidence.get('area', 0):.3g} m\u00b2"))
    if evidence.get("observations") is not None:
        rows.append(("Views", f"{evidence['observations']:.0f}"))
    given = entry.get("given")
    if given:
        rows.append(("Given", ", ".join(f"{GIVEN.get(key, key)} {_value_text(value)}" for key, value in given.items())))
    return [*rows, ("Certainty", certainty(entry).capitalize())]


def _value_text(value) -> str:
    if isinstance(value, (list, tuple)):
        return " ".join(map(_value_text, value))
    return f"{value:.2f}" if isinstance(value, float) else label(str(value))


def _between(value: float, low: float | None, high: float | None) -> str:
    return f"{value:.2f}" if None in (low, high) else f"{value:.2f}  ({low:.2f} to {high:.2f})"
