"""Light that a capture stores on its mesh: radiance by tiles, or a texture that a scanning app baked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class LitTiles:
    """Radiance that the capture stores on the mesh itself: a square tile for each face of its file.

    Attributes
    ----------
    paths : tuple of Path
        Square pictures of raw RGB half floats, row by row, linear Rec.709; without a header.
    side : tuple of int
        Edge of each picture in texels.
    size : int
        Edge of a tile in texels; tiles fill a picture row by row.
    picture, tile : (t,) int32
        Which tile of which picture each triangle shows.
    uv : (t, 3, 2) float32
        Its corners within the tile, 0...1: u along its rows, v from row to row.
    """

    paths: tuple[Path, ...]
    side: tuple[int, ...]
    size: int
    picture: np.ndarray
    tile: np.ndarray
    uv: np.ndarray

    def part(self, chosen: np.ndarray) -> LitTiles:
        """For some of the triangles ((t,) bool)."""
        return replace(self, picture=self.picture[chosen], tile=self.tile[chosen], uv=self.uv[chosen])


@dataclass(frozen=True)
class StoredPicture:
    """A picture that is a file, or lies within one.

    Attributes
    ----------
    begin, length : int
        Its bytes within the file; a length of 0 is the whole file.
    """

    path: Path
    begin: int = 0
    length: int = 0


@dataclass(frozen=True)
class LitTexture:
    """Radiance that a scan's baked texture shows, up to one factor: what an app made of pictures that it had taken.

    Attributes
    ----------
    picture : (t,) int32
        Which of them each triangle shows; -1 none.
    uv : (t, 3, 2) float32
        Its corners on the picture: v points up, and the picture repeats beyond 0...1.
    transfer : str
        Curve of the codes.
    """

    pictures: tuple[StoredPicture, ...]
    picture: np.ndarray
    uv: np.ndarray
    transfer: str

    def part(self, chosen: np.ndarray) -> LitTexture:
        """For some of the triangles ((t,) bool)."""
        return replace(self, picture=self.picture[chosen], uv=self.uv[chosen])
