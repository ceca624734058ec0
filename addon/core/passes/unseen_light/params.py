"""When light that no frame sees is believed in; what each part gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class UnseenParams:
    """Of `unseen_light`, `unseen_lamps`, `sky` and `whole_sky`, by their names in the ablation.

    Attributes
    ----------
    lamp_gain : float
        A lamp nobody saw is believed in when it lowers the spread of log albedo by at least this share.
    sweeps : int
        Times that all parts of the sky are solved for in turn.
    darker : float
        Nor one that is darker by more than this, where frames saw some of that side of the horizon: noise in E and G
        draws solutions down. The living room's ground, .22 where it was seen, came out at .08 and took two clipped
        lamps down with it (two perturbed scans: .95 of their luminance; .97 under 1.5, .994 under 1.25, 1.03 under
        1.1).
    """

    lamp_gain: float = 0.03
    sweeps: int = 2
    darker: float = 1.25


UNSEEN = UnseenParams()
