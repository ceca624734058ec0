"""Parameters and priors of radiometric calibration."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CalibrationParams:
    """Of `calibrate`.

    Attributes
    ----------
    points : int
        Of the surface, that are looked for in all frames; gains of 96 frames have a standard error of .01 stops then.
    least_points : int
        For each frame, where there are many.
    flat : float
        A place counts where codes around it, as far as poses may be off, differ by less than this share.
    darkest : float
        Codes below this share of the greatest are mostly read noise and quantisation.
    grazing : float
        Cosine below which a surface is seen too flatly.
    splines : int
        Of a cubic B-spline that the logarithm of the response may differ by from the prior's.
    roughness : float
        Weight of its squared second differences, in observations: what the codes do not cover follows the prior.
    noise : float
        Of a code, standard deviation as share of the greatest: two codes of 8 bits.
    texture : float
        Relative standard deviation that radiance differs by between views of one place beside it.
    least_range : float
        Standard deviation of the logarithm of stated exposures from which on they determine the curve's contrast.
    widest : float
        Contrast that stated exposures may give the curve, over the prior's.
    border : float
        Share of a picture at each side by which cameras don't meter.
    rates : int
        By which a camera may follow what it sees, from the first frame alone to at once, that are tried.
    cast : float
        Standard deviation of the logarithm of the mean white balance: light of 4500 K for 6500 K is .3.
    strength_error : float
        Standard error of how much a camera balances, beside that of its fit: none does as the model has it.
    """

    points: int = 8192
    least_points: int = 16
    flat: float = 0.25
    darkest: float = 0.03
    grazing: float = 0.3
    splines: int = 10
    roughness: float = 100.0
    noise: float = 2 / 255
    texture: float = 0.03
    least_range: float = 0.1
    widest: float = 2.0
    border: float = 1 / 6
    rates: int = 32
    cast: float = 0.3
    strength_error: float = 0.1


CALIBRATION = CalibrationParams()
