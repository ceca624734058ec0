"""How a capture is to be read, as properties of operators and of the scene; one for each field of `Reading`."""

from pathlib import Path

import bpy

from ...addon.core.io.formats import FORMATS, MATERIALS, SHAPE
from ...addon.core.io.layout import Reading
from ..base.properties import bool_property, enum_property, file_property, string_property
from ..translations import OWN

FOUND, FILE = "FOUND", "FILE"
FORMAT_ITEMS = [
    (FOUND, "From the Folder", "Find the format from what the folder holds"),
    *((name, name, f"Known by {wants}") for name, wants in FORMATS.items()),
]
CURVES = (
    (FOUND, "Calibrated", "Response and exposures are estimated from what several pictures show"),
    ("srgb", "sRGB", "The curve of screens and of most pictures of 8 bits"),
    ("linear", "Linear", "Stored numbers are proportional to light"),
)
SEGMENTS = (
    (FOUND, "As the Capture Tells", "What the mesh or pictures of ids tell, else the mesh's shape"),
    (MATERIALS, "Materials", "Each material of an OBJ or glTF mesh is an object"),
    (SHAPE, "Shape", "Take the mesh apart by its shape, whatever the capture tells"),
    (FILE, "File", "A file tells the object of each face"),
)


class ReadingProps:
    """The properties, for operators and property groups."""

    reading_format: enum_property("Format", "Layout of the capture's folder", FORMAT_ITEMS, default=FOUND)
    reading_mesh: file_property(
        "Mesh", "The mesh, where it is not the one that the format names", translation_context=OWN
    )
    reading_outside: bool_property("Files Outside", "Let the capture's files name others outside of its folder")
    reading_transfer: enum_property("Picture Curve", "Curve of pictures of 8 and 16 bits", CURVES)
    reading_exposures: file_property("Exposures", "CSV file with the exposure of each frame: lines of name, exposure")
    reading_convention: string_property(
        "Poses", "Name of a correction of all poses, as the check of the capture proposes it"
    )
    reading_segments: enum_property("Objects", "What tells which object each face of the mesh belongs to", SEGMENTS)
    reading_segments_file: file_property(
        "Segments", "A number for each face of the mesh (.txt, .csv or .npy), or the mesh painted by objects (.ply)"
    )


NAMES = tuple(ReadingProps.__annotations__)


def visible_names(owner) -> list[str]:
    """The properties that mean something beside `owner`'s others."""
    return [name for name in NAMES if name != "reading_segments_file" or owner.reading_segments == FILE]


def reading(owner) -> Reading:
    """`owner`'s properties as the argument of `read_capture`."""
    from ...addon.bridge.data.import_mesh import import_mesh

    def file(path: str) -> Path | None:
        return Path(bpy.path.abspath(path)) if path else None

    segments = owner.reading_segments
    return Reading(
        "" if owner.reading_format == FOUND else owner.reading_format,
        file(owner.reading_mesh),
        owner.reading_outside,
        "" if owner.reading_transfer == FOUND else owner.reading_transfer,
        file(owner.reading_exposures),
        owner.reading_convention,
        (file(owner.reading_segments_file) or Path()) if segments == FILE else "" if segments == FOUND else segments,
        import_mesh,
    )


def options(owner) -> list[str]:
    """`owner`'s properties as options of the command line."""
    requested = reading(owner)
    names = ("format", "mesh", "transfer", "exposures", "convention", "segments")
    values = {name: getattr(requested, name) for name in names}
    words = [word for name, value in values.items() if value for word in (f"--{name}", str(value))]
    return [*words, "--outside"] if requested.outside else words
