"""How a capture is to be read, as properties of operators and of the scene; one for each field of `Reading`."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import inspect
from pathlib import Path

import bpy

from ...addon.core.io.formats import FORMATS
from ...addon.core.io.layout import Reading
from ..translations import OWN

FOUND = "FOUND"
CURVES = (
    ("FOUND", "Not Given", "Pictures of 8 and 16 bits are refused, as their curve is unknown"),
    ("srgb", "sRGB", "The curve of screens and of most pictures of 8 bits"),
    ("linear", "Linear", "Stored numbers are proportional to light"),
)
NAMES = (
    "reading_format",
    "reading_mesh",
    "reading_outside",
    "reading_transfer",
    "reading_exposures",
    "reading_convention",
)


def format_items() -> list[tuple[str, str, str]]:
    """Items of an enumeration of the formats."""
    return [
        (FOUND, "From the Folder", "Find the format from what the folder holds"),
        *((name, name, f"Known by {wants}") for name, wants in FORMATS.items()),
    ]


def with_reading(cls):
    """Class decorator: give an operator or property group one property for each field of `Reading`."""
    string, own = bpy.props.StringProperty, inspect.get_annotations(cls)
    cls.__annotations__ = own | dict(
        zip(
            NAMES,
            (
                bpy.props.EnumProperty(
                    name="Format", description="Layout of the capture's folder", items=format_items(), default=FOUND
                ),
                string(
                    name="Mesh",
                    description="The mesh, where it is not the one that the format names",
                    subtype="FILE_PATH",
                    translation_context=OWN,
                ),
                bpy.props.BoolProperty(
                    name="Files Outside", description="Let the capture's files name others outside of its folder"
                ),
                bpy.props.EnumProperty(
                    name="Picture Curve", description="Curve of pictures of 8 and 16 bits", items=CURVES
                ),
                string(
                    name="Exposures",
                    description="CSV file with the exposure of each frame: lines of name, exposure",
                    subtype="FILE_PATH",
                ),
                string(
                    name="Poses",
                    description="Name of a correction of all poses, as the check of the capture proposes it",
                ),
            ),
            strict=True,
        )
    )
    return cls


def options(owner) -> list[str]:
    """What `owner`'s properties are on the command line."""
    words = []
    if owner.reading_format != FOUND:
        words += ["--format", owner.reading_format]
    if owner.reading_mesh:
        words += ["--mesh", bpy.path.abspath(owner.reading_mesh)]
    if owner.reading_outside:
        words.append("--outside")
    if owner.reading_transfer != FOUND:
        words += ["--transfer", owner.reading_transfer]
    if owner.reading_exposures:
        words += ["--exposures", bpy.path.abspath(owner.reading_exposures)]
    if owner.reading_convention:
        words += ["--convention", owner.reading_convention]
    return words


def reading(owner) -> Reading:
    """What `owner`'s properties are for `read_capture`."""

    def import_mesh(path: Path):
        from ...addon.bridge.data.import_mesh import import_mesh as through_blender

        return through_blender(path)

    return Reading(
        "" if owner.reading_format == FOUND else owner.reading_format,
        Path(bpy.path.abspath(owner.reading_mesh)) if owner.reading_mesh else None,
        owner.reading_outside,
        "" if owner.reading_transfer == FOUND else owner.reading_transfer,
        Path(bpy.path.abspath(owner.reading_exposures)) if owner.reading_exposures else None,
        owner.reading_convention,
        import_mesh,
    )


def draw(layout, owner) -> None:
    """All of them, one below the other."""
    for name in NAMES:
        layout.prop(owner, name)
