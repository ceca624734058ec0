"""What a stage of the recovery declares. The key of what is stored of it follows from that and from its source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..json_values import key
from ..origin import of_thing
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
        return frozenset({self.name}.union(*(one.after for one in self.takes)))

    def settings(self, asked: Settings) -> Settings:
        """Settings as the stage sees them: what it does not declare has its default, so that no result rests on it."""
        heeded = {name: getattr(asked, name) for name in self.heeds}
        without = tuple(name for name in asked.without if stage_of(name) in self.after)
        return Settings(**heeded, without=without, threads=asked.threads)

    def key(self, asked: Settings, before: dict[str, str], *more: Any) -> str:
        """The key of its result.

        Parameters
        ----------
        asked : Settings
        before : dict of str
            Keys of the stages that it takes, by name.
        more
            What else its result depends on.
        """
        heeded = {name: getattr(asked, name) for name in self.heeds}
        taken = [before[one.name] for one in self.takes]
        others = tuple((one.name, one.origin or of_thing(one.run)) for one in following(self.name, asked.without))
        more += (others,) if others else ()
        return key(self.name, digest(self.source), taken, heeded, left_out_of(self.name, asked.without), *more)
