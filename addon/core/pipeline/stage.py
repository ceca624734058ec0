"""What a stage of the recovery declares. The key of what is stored of it follows from that and from its source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..json_values import key
from ..origin import package_of
from ..passes.registry import following, left_out_of, stage_of
from ..settings import Settings
from .source import digest


@dataclass(frozen=True)
class Stage:
    """One stage.

    Attributes
    ----------
    name : str
        One of `stages.STAGES`.
    source : Path
        The module that computes it; its code and all that it imports is heeded.
    takes : tuple of Stage
        Those whose results it is computed from.
    heeds : tuple of str
        The fields of `Settings` that it heeds.
    divided_by : str
        What its work can be divided by between workers, with the same bytes in the end; '' where it can't be.
    """

    name: str
    source: Path
    takes: tuple[Stage, ...]
    heeds: tuple[str, ...]
    divided_by: str = ""

    @property
    def after(self) -> frozenset[str]:
        """Names of all stages that bear on it, its own included."""
        return frozenset({self.name}.union(*(stage.after for stage in self.takes)))

    def settings(self, requested: Settings) -> Settings:
        """Settings as the stage sees them: what it does not declare has its default, so that no result rests on it."""
        declared = {name: getattr(requested, name) for name in self.heeds}
        without = tuple(name for name in requested.without if stage_of(name) in self.after)
        return Settings(**declared, without=without, threads=requested.threads)

    def key(self, settings: Settings, previous: dict[str, str], *more: Any) -> str:
        """The key of its result.

        Parameters
        ----------
        settings : Settings
        previous : dict of str
            Keys of the stages that it takes, by name.
        more
            What else its result depends on.
        """
        declared = {name: getattr(settings, name) for name in self.heeds}
        previous_keys = [previous[stage.name] for stage in self.takes]
        packages = tuple(
            (item.name, item.origin or package_of(item.run)) for item in following(self.name, settings.without)
        )
        more += (packages,) if packages else ()
        return key(
            self.name, digest(self.source), previous_keys, declared, left_out_of(self.name, settings.without), *more
        )
