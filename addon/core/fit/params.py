"""How a lobe is fitted."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LobeFitParams:
    """Of `lobe_fit`.

    Attributes
    ----------
    rounds, kappas, least_signal : int, tuple[float, ...], float
        Share of <A, A> that must be left once the noise's is taken out; where less is, psi rests on nothing, and is
        only prevented from growing without bound.
    light_error : float
        Standard deviation of the radiance that a lobe is predicted to reflect, over that radiance. With the materials'
        true alpha and F0 the living room's frames were off by .18 (sky that frames see) to .3 of what was predicted
        (sky that is guessed, lamps in a polished table, other glossy things).
    """

    rounds: int = 3
    kappas: tuple[float, ...] = (0.0, 0.15, 0.3, 0.45, 0.6)
    least_signal: float = 0.1
    light_error: float = 0.3


LOBE_FIT = LobeFitParams()
