"""How the projection's blur is removed; what it gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SharpeningParams:
    """Of `sharpen` (`sharpening` in the ablation).

    Attributes
    ----------
    detail : float
        Share of its radiance by which an element must differ from the mean of the texels around it: where L_d is even,
        there is nothing to sharpen.
    most : float
        Times that L_d may become brighter or darker.
    """

    detail: float = 0.02
    most: float = 2.0


SHARPENING = SharpeningParams()
