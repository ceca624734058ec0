"""Parameters of the light that glossy surfaces reflect; what each part gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GlossyLightParams:
    """Of `glossy_light` and `caustics` (`glossy-light` and `caustics` in the ablation).

    Attributes
    ----------
    rays, lobe_rays : int
        Of each place, and of each of its rays that meets something glossy. 64 with 16 came to the same albedo within
        0.02 dB in the living room.
    finest_share : float
        Least distance of two places, as a share of the room: four times that of all light. Albedo of a kitchen with
        .04, this and .01: 28.49, 28.64, 28.71 dB, of a bathroom 27.19, 27.22, 27.21; .01 takes 2 s longer in the living
        room.
    most_taken : float
        Of E that may be taken away, by noise or where a median was all highlight.
    photons : int
        Kitchen with seven small lamps: 26.37 dB of albedo with half as many, 26.43 with these and with four times
        these.
    bounces : int
        Glossy reflections in a row. Beside copper shades half of the light on a kitchen's wall came by no other way,
        and a third of that by more than one; its albedo with 1 and 4: 27.85, 28.51 dB, in coarser frames 27.71, 28.96;
        no more by 10.
    doublings : int
        Of a cell's edge, where too few photons fell.
    """

    rays: int = 32
    lobe_rays: int = 4
    finest_share: float = 0.02
    most_taken: float = 0.5
    photons: int = 1 << 18
    bounces: int = 4
    doublings: int = 3


GLOSSY = GlossyLightParams()
