"""Which of an OpenEXR file's channels are the picture.

Files hold layers (`diffuse.R`), views (left and right eye) and parts (each with channels of its own), and nothing in
them says which is what the camera saw. The rule: the default view; in it the channels R, G, B without a layer's name;
else the layer that is called as renderers call the whole picture (`WHOLE`); else the only one. Several others: refused,
with their names.
Source: openexr.com, "Technical Introduction" (layers, luminance and chroma), "Multi-View OpenEXR".
"""

from dataclasses import dataclass
from pathlib import Path

from ..errors import BadInputError
from .exr_header import ExrHeader

WHOLE = ("", "rgba", "rgb", "combined", "beauty", "main", "default", "composite")
"""Names of a layer that is the whole picture, best first; compared without case, the last word of dotted names."""
RGB, CHROMA, GRAY = ("R", "G", "B"), ("Y", "RY", "BY"), ("Y",)


@dataclass(frozen=True)
class ExrLayer:
    """A layer of the file that has colours.

    Attributes
    ----------
    header : ExrHeader
        Of that part.
    name : str
        As a user knows it; '' for the unnamed one.
    colour : tuple of str
        Channels in full: R, G, B; or Y, RY, BY; or Y.
    alpha : str or None
        Channel.
    """

    part: int
    header: ExrHeader
    name: str
    colour: tuple[str, ...]
    alpha: str | None

    @property
    def has_chroma(self) -> bool:
        """Whether the colours are luminance and chroma."""
        return self.colour[-1].upper().endswith("BY")


def choose_layer(headers: tuple[ExrHeader, ...], path: Path) -> tuple[ExrLayer, str]:
    """The layer that is the picture, and a note ('' where there was no choice).

    Raises `BadInputError` where no layer has colours, or several do and none is called as the whole picture.
    """
    view = next((h.view for h in headers if h.view), "")
    views = tuple(dict.fromkeys([h.view for h in headers if h.view] + [v for h in headers for v in h.views]))
    layers = [
        layer
        for i, header in enumerate(headers)
        if header.view in ("", view)
        for layer in _layers(i, header, len(headers) > 1)
    ]
    other_views = {name for header in headers for name in header.views[1:]}
    layers = [layer for layer in layers if layer.name.split(".")[-1] not in other_views]
    if not layers:
        names = ", ".join(sorted(name for header in headers for name in header.channels)[:6])
        raise BadInputError(f"Picture '{path}' holds the channels {names}; write it with R, G and B.")
    ranked = sorted((layer for layer in layers if _rank(layer) < len(WHOLE)), key=_rank)
    if not ranked and len(layers) > 1:
        names = ", ".join(layer.name for layer in layers[:6]) + (", ..." if len(layers) > 6 else "")
        raise BadInputError(
            f"Picture '{path}' holds the layers {names}, and none is named as the whole picture; "
            "write that one alone, or name it 'beauty'."
        )
    chosen = ranked[0] if ranked else layers[0]
    choices = []
    if len(views) > 1:
        choices.append(f"of the views {', '.join(views)}, '{view or views[0]}'")
    if len(layers) > 1 and chosen.name:
        choices.append(f"of {len(layers)} layers, '{chosen.name}'")
    return chosen, " and ".join(choices)


def _rank(layer: ExrLayer) -> int:
    last = layer.name.split(".")[-1].lower()
    return WHOLE.index(last) if last in WHOLE else len(WHOLE)


def _layers(part: int, header: ExrHeader, several: bool) -> list[ExrLayer]:
    """The layers of one part that have colours; those without a name take the part's where there are several."""
    by_layer: dict[str, dict[str, str]] = {}
    for channel in header.channels:
        layer, _, base = channel.rpartition(".")
        by_layer.setdefault(layer, {})[base.upper()] = channel
    part_name = header.name if several else ""
    if header.view and part_name.lower().endswith("." + header.view.lower()):
        part_name = part_name[: -len(header.view) - 1]
    layers = []
    for layer, bases in by_layer.items():
        colour = next((kind for kind in (RGB, CHROMA, GRAY) if all(base in bases for base in kind)), None)
        if colour is not None:
            layers.append(
                ExrLayer(part, header, layer or part_name, tuple(bases[base] for base in colour), bases.get("A"))
            )
    return layers
