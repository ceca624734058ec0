"""What a patch of sun sends that frames clip: its L_d is a lower bound, and it may light a room more than windows do.

It reflects the sun by its object's mean albedo elsewhere: of a striped blanket the sun lights all stripes.
"""

import numpy as np

from ...groups import by_number
from ...light.few_elements import from_sun
from ...light.field import LightField
from ...significance import LEVELS


def with_clipped_sunlight(
    field: LightField, clipped: np.ndarray, element: np.ndarray, received: np.ndarray, object_id: np.ndarray
) -> np.ndarray:
    """L_d in which clipped elements under the sun send what they reflect of it, (n, 3) float32.

    Parameters
    ----------
    field : LightField
        With L_d and the sun.
    clipped : (n,) bool
        Whether an element's radiance is a lower bound.
    element : (m,) int
        A sample of all elements.
    received : (m, 3) float64
        E there, without the sun.
    object_id : (n,) int
        The object of each element. Where the sample has too few of one, its L_d stays.
    """
    radiance = field.radiance.copy()
    known = ~clipped[element] & (radiance[element] > 0).all(1)
    element, received = element[known], received[known]
    E = received + from_sun(field, element)
    albedo = np.minimum(np.pi * radiance[element] / np.maximum(E, 1e-12), 1)
    sunlit = np.flatnonzero(clipped)
    sunlight = from_sun(field, sunlit)
    sunlit, sunlight = sunlit[sunlight.any(1)], sunlight[sunlight.any(1)]
    of_object = by_number(object_id[element])
    for number, members in by_number(object_id[sunlit]).items():
        own = of_object.get(number, element[:0])
        if len(own) < LEVELS.few:
            continue
        reflected = albedo[own].mean(0) * (sunlight[members] + np.median(received[own], 0)) / np.pi
        radiance[sunlit[members]] = np.maximum(radiance[sunlit[members]], reflected)
    return radiance
