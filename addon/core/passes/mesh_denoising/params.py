"""Parameters of the mesh denoising; what each part gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DenoiseParams:
    """Of `denoise` and, but for the first two, of `planes` (`mesh-denoising` and `sheets` in the ablation).

    Attributes
    ----------
    least_noise : float
        Metres. Below, what is measured may be shape: a modelled living room has 0.13 mm.
    tolerance : float
        Of each linear solve, by conjugate gradients.
    reach : float
        Times the noise (and the plane's own uncertainty), how far denoised points may lie off, as a scan's smooth error
        shows: half smooth, half from vertex to vertex it has 1.4 times what `noise_of` sees. No point goes farther.
    turn : float
        Radians by which a large triangle may face another way than its plane, besides what noise tilts it by; and
        within which two sheets have no line in common.
    known : float
        Radians, standard error of the way that a plane faces. Known less well, it is no better than what is there:
        denoised triangles of a few times the noise are off by 0.05 to 0.2.
    fill : float
        Of its extent a region covers as much, unless its own width tells enough: a moulding around a room is a ring
        that lies in a plane, whichever way it faces.
    spread : float
        Times the noise, the points' distance from a plane (root mean square), for a scan's smooth error: 1.4 if half.
    bent : float
        Chi squared with three degrees of freedom up to which a bend may be noise: twice 12, which chance exceeds once
        in 130 times, for the smooth error.
    gentle : float
        Radians, root mean square, by which a bend turns the normals of what is called flat: where the bend is sure, and
        where it may be noise (together with what the noise makes it by chance). Strips of a cylinder of 6 cm have 0.1
        to 0.2 and too few points to be sure; chamfers of 1.5 cm taken into a sofa's front 0.06.
    determined : float
        Points tell a quadratic term by at least this much of what they would if spread at random.
    stiff : float
        How much firmer a sheet holds its points than the denoised places do, as a ratio of standard deviations.
    """

    least_noise: float = 0.001
    tolerance: float = 1e-3
    reach: float = 4.5
    turn: float = 0.15
    known: float = 0.05
    fill: float = 0.3
    spread: float = 1.6
    bent: float = 24.0
    gentle: float = 0.015
    determined: float = 0.3
    stiff: float = 50.0


DENOISE = DenoiseParams()
