"""What was fused of a globe. Blender's side asks for it as the add-on starts, so this imports no scipy."""

import numpy as np

from ..significance import LEVELS
from .params import SIDES


def bulges(normal: np.ndarray, area: np.ndarray) -> bool:
    """Whether triangles of these normals ((t, 3), unit) and areas ((t,)) are what was fused of a globe, by its front.

    Of a lamp it shines on both sides: what lacks, as no frame saw it, shines too, and the inside does in its stead.
    The normals of a few triangles are noise.
    """
    return len(area) >= LEVELS.few and bool(np.linalg.norm(area @ normal) < SIDES.flat * area.sum())
