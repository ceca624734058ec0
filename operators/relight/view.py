"""`bpy.ops.scan_relight.*` for the camera: a frame's, with its picture behind, or the one along the capture's track."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.data.cameras import frame_cameras, track_cameras, use_camera
from ...addon.bridge.relight import match_frame
from ...addon.core.errors import BadInputError
from ..base import poll
from .base import SceneOperator
from .props import look_through


@poll.needs(
    lambda context: frame_cameras(context.scene), "The scene has no camera of a capture; import a capture first."
)
class SCAN_RELIGHT_OT_match_frame(SceneOperator, bpy.types.Operator):
    """Look and render through the camera of a frame of the capture"""

    bl_idname = "scan_relight.match_frame"
    bl_label = "Look Through Frame"

    index: bpy.props.IntProperty(name="Frame", description="In the capture's order, from 0", min=0)
    size: bpy.props.BoolProperty(
        name="Match Render Size", description="Render at the frame's size and with its shape of pixels, too"
    )
    step: bpy.props.IntProperty(name="Step", description="So many frames on from the present one; 0 takes the frame")

    def work(self, context):
        scene = context.scene
        count = len(frame_cameras(scene))
        index = (match_frame.current(scene) + self.step) % count if self.step else self.index
        if index >= count:
            raise BadInputError(f"There is no frame {index}; the capture's last one is {count - 1}.")
        told = look_through(scene.scan_relight_studio, index, self.size)
        see_through_camera(context)
        return [told] if told else []


@poll.needs(
    lambda context: track_cameras(context.scene),
    "The scene has no camera along a capture's track; bring a room of at least two frames in first.",
)
class SCAN_RELIGHT_OT_follow_track(SceneOperator, bpy.types.Operator):
    """Look and render through a camera that goes where the capture's went: play the timeline, a frame of it for each of
    the capture's"""

    bl_idname = "scan_relight.follow_track"
    bl_label = "Go Along the Track"

    def work(self, context):
        use_camera(context.scene, track_cameras(context.scene)[0], size=False)
        see_through_camera(context)


def see_through_camera(context) -> None:
    """Have the 3D view that a button was pressed in look through the scene's camera."""
    space = context.space_data
    if space is not None and space.type == "VIEW_3D" and space.region_3d is not None:
        space.region_3d.view_perspective = "CAMERA"
