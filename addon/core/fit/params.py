"""How a lobe is fitted."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LobeFitParams:
    """Of `lobe_fit`.

    Attributes
    ----------
    rounds, kappas, least_signal : int, tuple[float, ...], float
        Share of <A, A> that must be left once the noise's is taken out; where less is, psi rests on nothing, and is
        only prevented from growing without bound.
    """

    rounds: int = 3
    kappas: tuple[float, ...] = (0.0, 0.15, 0.3, 0.45, 0.6)
    least_signal: float = 0.1


LOBE_FIT = LobeFitParams()
