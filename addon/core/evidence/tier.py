"""How well a capture's frames measure radiance: the first thing to know of how far to trust a result."""

from ..scene.model import AUTO, Capture, Frame
from ..scene.stored_light import LitTexture

TIERS = {
    "hdr": "HDR frames: their radiance is as it was recorded.",
    "brackets": "Brackets of pictures with known exposures: their radiance is merged.",
    "curve": "Pictures of 8 or 16 bits whose curve was told: what they clip is not known.",
    "exposures": "Pictures of 8 or 16 bits with known exposures: the curve is estimated; what they clip is not known.",
    "codes": "Pictures of 8 or 16 bits alone: exposures, white balance and curve are estimated, and brightness and "
    "contrast of all albedo may be off.",
    "baked": "No frames: a scan's baked texture is taken for the light, which is weaker than any frames; nothing tells "
    "of highlights, exposures or what it clips.",
    "texture": "No frames: the light is the one stored on the mesh, and nothing tells of highlights.",
}
"""From the best to the least; what report.json says, and the sentence."""


def tier(capture: Capture) -> str:
    """The name in `TIERS` that most of a capture's frames have."""
    if not capture.frames:
        return "baked" if isinstance(capture.mesh.lit, LitTexture) else "texture"

    exposures_known = len({frame.exposure for frame in capture.frames}) > 1

    def name_of(frame: Frame) -> str:
        if frame.brackets:
            return "brackets"
        if frame.transfer != AUTO:
            return "curve" if frame.transfer else "hdr"
        return "exposures" if exposures_known else "codes"

    names = [name_of(frame) for frame in capture.frames]
    return max(TIERS, key=names.count)
