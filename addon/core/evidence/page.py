"""The page that tells a person in a minute what was recovered and how far to trust it: one HTML file, no script."""

from html import escape
from typing import Any

import numpy as np

from ..brdf.material import Z90, ObjectMaterial
from ..brdf.registry import models
from ..errors import BadInputError
from ..io.png import data_address
from ..kinds import Shown
from ..photo import encoded
from ..significance import LEVELS
from .collect import Evidence
from .colours import heat_css
from .findings import Findings
from .objects import ObjectEvidence
from .pictures import Picture, pictures_of
from .style import STYLE
from .tier import TIERS
from .views import choose_frames, view

FRAMES: Shown[int] = 3
ROWS: Shown[int] = 80
"""Objects in the table; materials.json lists them all."""


def make_page(findings: Findings, evidence: Evidence, report: dict[str, Any]) -> str:
    """The page of a finished recovery.

    Parameters
    ----------
    report : dict
        What report.json will hold.
    """
    name = escape(findings.name)
    parts = [
        f"<h1>{name} <small>recovered by Scan Relight</small></h1>",
        f"<p><b>{escape(TIERS[report['tier']])}</b></p>",
        _facts(findings, report),
        _warnings(report["warnings"]),
        _pictures(findings, evidence),
        _objects(findings, evidence),
        _lamps(findings),
        "<footer>Intervals are meant to hold the truth nine times out of ten; docs/evidence.md says how that was "
        "measured. The numbers behind this page: report.json, materials.json, coverage.exr, albedo_error.exr, "
        "evidence.exr.</footer>",
    ]
    head = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{name}: recovered</title><style>{STYLE.replace('HEAT', heat_css())}</style></head><body>"
    )
    return head + "\n".join(parts) + "</body></html>\n"


def _facts(findings: Findings, report: dict[str, Any]) -> str:
    figures, errors = report["figures"], report["figures"]["evidence"]
    lamps = findings.shading.lamps
    hidden = sum(not lamp.seen for lamp in lamps)
    glossy = sum(m.model.has_lobe for m in findings.materials)
    tiles = [
        (f"{1 - figures['unseen_share']:.0%}", "of the surface seen by a frame; the rest is filled in"),
        (f"&plusmn;{Z90 * errors.get('albedo_error_median', 1):.0%}", "of an albedo that was measured, in the median"),
        (f"{errors.get('unseen_light_mean', 0):.0%}", "of the light comes from what no frame saw"),
        (f"{glossy} of {len(findings.materials)}", "objects with a highlight"),
        (f"{len(lamps)}", "lamps" + (f", {hidden} of them solved for" if hidden else "")),
        (
            f"{figures['frames']}",
            f"frames, {figures['observations_median']:.0f} views of a spot in the median"
            if figures["frames"]
            else "frames; the light is stored on the mesh",
        ),
    ]
    return '<div class="tiles">' + "".join(f"<div><b>{value}</b>{text}</div>" for value, text in tiles) + "</div>"


def _warnings(warnings: list[str]) -> str:
    if not warnings:
        return "<p>No warnings.</p>"
    return '<ul class="warnings">' + "".join(f"<li>{escape(warning)}</li>" for warning in warnings) + "</ul>"


def _pictures(findings: Findings, evidence: Evidence) -> str:
    names = {i.object_id: i.name for i in findings.instances}
    if not findings.frames:
        return "<h2>Frames</h2><p>None; the light is the one stored on the capture's mesh.</p>"
    result = ["<h2>Frames</h2>"]
    for index in choose_frames(findings, FRAMES):
        try:
            seen = view(findings, index)
        except BadInputError:  # it was readable before; the page is not what to stop for
            continue
        pictures, worst = pictures_of(findings, evidence.texels, seen)
        residuals = ", ".join(f"{escape(names.get(i, 'outside'))} {size:.0%}" for i, size in worst)
        result.append(
            f"<h3>{escape(findings.frames[index].name)} <small>worst residuals: {residuals or 'none'}</small></h3>"
        )
        result.append('<div class="frames">' + "".join(map(_figure, pictures)) + "</div>")
    chips = "".join(
        f'<span><i style="background:rgb{model.colour}"></i>{escape(model.name)}</span>' for model in models()
    )
    return "\n".join(result) + f'<p class="chips">{chips}<span>lighter: glossier</span></p>'


def _figure(picture: Picture) -> str:
    legend = f'<span class="heat"></span> {picture.legend}' if picture.legend else ""
    return (
        f'<figure><img alt="{escape(picture.title)}" src="{data_address(picture.image)}">'
        f"<figcaption>{escape(picture.title)} {legend}</figcaption></figure>"
    )


def _objects(findings: Findings, evidence: Evidence) -> str:
    """A table of the objects, the least certain first."""
    by_id = {item.object_id: item for item in evidence.objects}
    pairs = [(m, by_id[m.object_id]) for m in findings.materials if m.object_id in by_id and not m.model.gives_light]
    pairs.sort(key=lambda pair: -_relative_width(pair[1]))
    rows = "".join(_row(m, e) for m, e in pairs[:ROWS])
    more = f"<p>{len(pairs) - ROWS} more are in materials.json.</p>" if len(pairs) > ROWS else ""
    return (
        "<h2>Objects, the least certain first</h2><table><tr><th></th><th>object</th><th>model</th>"
        "<th>albedo</th><th>roughness</th><th>specular F0</th><th>seen</th><th>remarks</th></tr>"
        f"{rows}</table>{more}"
    )


def _relative_width(evidence: ObjectEvidence) -> float:
    """Half the width of an albedo's interval, relative to the albedo."""
    width = np.mean(evidence.albedo_high) - np.mean(evidence.albedo_low)
    return float(width / 2 / max(float(np.mean(evidence.albedo)), LEVELS.dark))


def _row(m: ObjectMaterial, e: ObjectEvidence) -> str:
    lobe_alone = m.model.lobe_alone
    colour = m.f0 if lobe_alone and m.f0 else e.albedo
    albedo = "" if lobe_alone else f"{np.mean(e.albedo):.2f} &plusmn; {_relative_width(e):.0%}"
    specular = "coloured" if isinstance(m.f0, tuple) else _interval(m.f0, m.f0_low, m.f0_high)
    roughness = _interval(None if m.alpha is None else float(np.sqrt(m.alpha)), m.roughness_low, m.roughness_high)
    return (
        f"<tr><td>{_swatch(colour)}</td><td>{escape(m.name)}</td>"
        f"<td>{escape(m.model.name)}</td><td>{albedo}</td><td>{roughness}</td>"
        f"<td>{specular}</td><td>{e.seen_share:.0%}</td><td>{escape(m.note)}</td></tr>"
    )


def _swatch(linear) -> str:
    return '<i style="background:rgb({} {} {})"></i>'.format(*encoded(np.asarray(linear)))


def _interval(value: float | None, low: float | None, high: float | None) -> str:
    between = "" if low is None or high is None else f" <small>{low:.2f}&ndash;{high:.2f}</small>"
    return ("unknown" if between else "") + between if value is None else f"{value:.2f}{between}"


def _lamps(findings: Findings) -> str:
    names = {i.object_id: i.name for i in findings.instances}
    lamps = findings.shading.lamps
    if not lamps:
        return "<h2>Lamps</h2><p>None; all light comes from outside.</p>"
    rows = "".join(
        f"<tr><td>{_swatch(lamp.radiance / max(lamp.radiance.max(), 1e-9))}</td>"
        f"<td>{escape(names.get(lamp.object_id, ''))}</td>"
        f"<td>{', '.join(f'{x:.3g}' for x in lamp.radiance)}</td><td>{'seen' if lamp.seen else 'solved for'}</td>"
        f"<td>{escape(lamp.note(names))}</td></tr>"
        for lamp in lamps
    )
    return (
        "<h2>Lamps</h2><table><tr><th></th><th>lamp</th><th>radiance (R, G, B)</th><th>how</th><th>remarks</th></tr>"
        f"{rows}</table>"
    )
