"""The reflectance models that there are, by name: those of this folder, and those that other packages bring.

Another package's is made known by `register`, or found by its entry point:

    [project.entry-points."scan_relight.brdfs"]
    beckmann = "my_package.beckmann:BECKMANN"
"""

import warnings
from functools import cache
from importlib.metadata import entry_points

from ..errors import BadInputError
from ..origin import package_of, package_of_entry_point
from .dielectric import DIELECTRIC
from .emitter import EMITTER
from .lambertian import LAMBERTIAN
from .metal import METAL
from .model import Brdf
from .transparent import TRANSPARENT

GROUP = "scan_relight.brdfs"
_models: dict[str, Brdf] = {model.name: model for model in (LAMBERTIAN, DIELECTRIC, METAL, EMITTER, TRANSPARENT)}


_packages: dict[str, str] = {}


def register(model: Brdf) -> Brdf:
    """Make a model known under its name; gives it back. Raises `BadInputError` where another one has that name."""
    if _models.setdefault(model.name, model) is not model:
        raise BadInputError(f"There is a reflectance model '{model.name}' already; give the new one another name.")
    return model


def models() -> tuple[Brdf, ...]:
    """All of them, the program's own first."""
    _installed()
    return tuple(_models.values())


def find(name: str | None) -> Brdf | None:
    """The model of a name; None where there is none."""
    if name not in _models:
        _installed()
    return _models.get(name) if name is not None else None


def origin(model: Brdf) -> str:
    """The package that a model comes from, and its version; "" for the program's own."""
    return _packages.get(model.name) or " ".join(filter(None, map(package_of, (model, model.microfacets))))


def find_or_lambertian(name: str | None) -> Brdf:
    """The model of a name, for display: `LAMBERTIAN` where its package is not installed."""
    return find(name) or LAMBERTIAN


def named(name: str) -> Brdf:
    """The model of a name; raises `BadInputError` where there is none."""
    model = find(name)
    if model is None:
        known = ", ".join(item.name for item in models())
        raise BadInputError(f"There is no reflectance model '{name}', only {known}; install the package that has it.")
    return model


@cache
def _installed() -> None:
    """Register, once, what installed packages bring; one that is broken is left out with a warning."""
    for entry in entry_points(group=GROUP):
        try:
            _packages[register(entry.load()).name] = package_of_entry_point(entry)
        except Exception as error:  # whatever another package does wrong
            warnings.warn(f"The reflectance model '{entry.name}' can't be loaded ({error!r}); mend it.", stacklevel=2)
