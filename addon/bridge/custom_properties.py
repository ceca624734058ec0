"""Names of the custom properties that identify recovered data: in this session, in a saved file, anywhere.

They need no registered add-on, so that a file keeps its meaning where the extension is not installed.
"""

from pathlib import Path

OBJECT_ID = "object_id"
"""Of an object (int): which instance of the capture it is. Of a recovered material: which part of that, where the
object has several; the main one's has none."""
BEFORE = "scan_relight_before"
"""Of an object of the artist's own scene: its original materials, mesh or copies."""
CAPTURE = "scan_relight_capture"
"""Of a room's collection: the folder of the capture that it came from."""
RESULT = "scan_relight_result"
"""Of a room's collection and of its objects: the result folder that their materials came from."""
RUN = "scan_relight_run"
"""Of a room's collection and of its objects: the key of the run (`materials.json`, "run") that made them."""
IMAGE = "scan_relight_image"
"""Of an image: the absolute path of the result folder's file that it came from."""
LAYOUT = "scan_relight_layout"
"""Of an image that an atlas lays out: the key of that layout (`materials.json`, "layout")."""
OWN_SCENE = "scan_relight_own"
"""Of a scene: True where it was made for a room and holds nothing else of the artist's."""
GIVEN = "scan_relight_given"
"""Of an object: JSON of the artist's override of its material; absent where there is none."""
WHITE = "scan_relight_white"
"""Of an object: the albedo, three numbers, that the artist gave; it fixes the whole room's scale."""
LAST_FOUND = "scan_relight_last_found"
"""Of a room's collection: JSON of what its last run found of each object."""
CHANGES = "scan_relight_changes"
"""Of a scene: what differs since the run before, as JSON: a list of objects with `object_id`, `name` and `text`."""
FOUND = "scan_relight_found"
"""Of an object: JSON of the recovered values that an override replaces."""
PAINTED = "scan_relight_painted"
"""Of an object: the artist's own Base Color image, which later runs leave alone. Of that image: where it came from."""
SMOOTH = "scan_relight_smooth"
"""Of an object: the angle in radians from which on its edges stay sharp."""

UV_MAP = "scan_relight_uv_map"
"""Of an image: name of the texture coordinates that it is laid out for; absent where those are the room atlas's."""


def set_run(owner, folder: Path | str, run: str, capture: Path | str | None = None) -> None:
    """Store which run made an object or a room's collection: its folder, its key (`room_file.run_of`), its capture."""
    owner[RESULT], owner[RUN] = str(Path(folder).absolute()), run
    if capture is not None:
        owner[CAPTURE] = str(Path(capture).absolute())
