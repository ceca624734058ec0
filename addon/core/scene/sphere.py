"""Directions spread evenly over the sphere."""

import numpy as np


def fibonacci(count: int) -> np.ndarray:
    """Unit directions at the places of Fibonacci's lattice, (count, 3) float64."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], 1)
