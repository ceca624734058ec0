"""What is behind glass, taken out of the observations of some elements and spread over the object.

The elements that were not looked at take over the difference to L_d from their neighbours, which varies slowly where
texture does not.
"""

import numpy as np
from scipy.spatial import cKDTree

from ...scene.atlas import Atlas
from ...scene.samples import Samples
from ...significance import LEVELS


def grouped_median(values: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Median of (m, 3) values over runs of equal, sorted `group` ((m,) int): the groups and their medians (k, 3)."""
    groups, start, count = np.unique(group, return_index=True, return_counts=True)
    result = np.empty((len(groups), values.shape[1]), values.dtype)
    for c in range(values.shape[1]):
        ordered = values[np.lexsort((values[:, c], group)), c]
        result[:, c] = (ordered[start + (count - 1) // 2] + ordered[start + count // 2]) / 2
    return groups, result


def specular_in_median(samples: Samples, chosen: np.ndarray, lobe: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How much of each sampled element's median is specular.

    Parameters
    ----------
    chosen : (k,) int
        Indices into `samples`, sorted by element.
    lobe : (k, 3) float32
        I_nd of each.

    Returns
    -------
    element : (e,) int
    specular : (e, 3) float32
        median(I) - median(I - I_nd), not below 0 and not above the median.
    """
    element, radiance = samples.element[chosen], samples.radiance[chosen]
    sampled_elements, median = grouped_median(radiance, element)
    _, diffuse = grouped_median(np.maximum(radiance - lobe, 0), element)
    return sampled_elements, np.clip(median - diffuse, 0, median).astype(np.float32)


def spread_over_object(atlas: Atlas, object_elements: np.ndarray, element: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Values at some elements of an object carried over to all of it.

    Parameters
    ----------
    object_elements : (n,) int
    element : (e,) int
        Those where the value is known.
    value : (e, 3) float32

    Returns
    -------
    (n, 3) float32
        Weighted mean of the nearest known ones, in place and orientation.
    """
    k = min(LEVELS.neighbours, len(element))
    distance, neighbours = cKDTree(atlas.place(element)).query(atlas.place(object_elements), k=k)
    distance, neighbours = distance.reshape(len(object_elements), k), neighbours.reshape(len(object_elements), k)
    # Weights that level off within the neighbourhood: each known value is noisy by itself.
    weight = 1 / (distance + distance[:, -1:] / 2 + 1e-6)
    weight /= weight.sum(1, keepdims=True)
    return np.einsum("nk,nkc->nc", weight.astype(np.float32), value[neighbours])
