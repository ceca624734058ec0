"""Type, default and help of each setting, from the `Settings` dataclass: the single source for all interfaces."""

import inspect
import re
import typing
from dataclasses import dataclass, fields

from .core.settings import Settings


@dataclass(frozen=True)
class SettingInfo:
    """One field of `Settings`.

    Attributes
    ----------
    kind : type
        bool, int, float or str.
    default : bool, int, float or str
    help : str
        One sentence or several, without the closing full stop; the first is a tooltip.
    choices : tuple of str
        Empty where any value goes.
    """

    name: str
    kind: type
    default: object
    help: str
    choices: tuple[str, ...]


def setting_infos() -> tuple[SettingInfo, ...]:
    """All settings of one value, in the dataclass's order; `Settings.without` is the command line's alone."""
    helps = _helps(inspect.getdoc(Settings) or "")
    kinds = typing.get_type_hints(Settings)
    return tuple(
        SettingInfo(f.name, kinds[f.name], f.default, helps.get(f.name, ""), Settings.CHOICES.get(f.name, ()))
        for f in fields(Settings)
        if f.name != "without"
    )


def _helps(docstring: str) -> dict[str, str]:
    """The texts below a NumPy-style docstring's 'Attributes', by name."""
    _, _, attributes = docstring.partition("Attributes\n----------\n")
    texts: dict[str, list[str]] = {}
    name = None
    for line in attributes.splitlines():
        head = re.match(r"(\w+) : ", line)
        if head:
            name = head[1]
            texts[name] = []
        elif name and line.startswith(" "):
            texts[name].append(line.strip())
    return {name: " ".join(lines).rstrip(".") for name, lines in texts.items()}
