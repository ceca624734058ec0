"""How bright linear Rec.709 looks."""

from __future__ import annotations

import numpy as np

LUMINANCE = np.float32([0.2126, 0.7152, 0.0722])
"""Weights of red, green and blue (ITU-R BT.709)."""
