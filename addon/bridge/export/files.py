"""Exported files in their place: the file and its folder of textures come and go together."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path


def textures_of(path: Path) -> str:
    """Name of the folder for a file's pictures, beside it: no other file's, though its stem or ending be the same."""
    return f"{path.name} textures"


def put(made: Path, path: Path) -> None:
    """Bring what was written into the folder `made` to its place beside `path`, `path` itself last.

    An earlier export of that very file is replaced with all its textures; nothing else is touched. Where it fails, what
    was there before is there again. Raises `OSError`.
    """
    if not (made / path.name).is_file() or not (made / path.name).stat().st_size:
        raise OSError(0, "Blender's exporter wrote nothing")
    path.parent.mkdir(parents=True, exist_ok=True)
    names = sorted({one.name for one in made.iterdir()} | {textures_of(path)}, key=lambda name: name == path.name)
    partial, before = ({name: path.parent / f".{kind}-{name}" for name in names} for kind in ("partial", "before"))
    done = []
    try:
        for name in names:
            _remove(partial[name], before[name])
            if (made / name).is_dir() and any((made / name).iterdir()):
                shutil.copytree(made / name, partial[name])
            elif (made / name).is_file():
                shutil.copyfile(made / name, partial[name])
        for name in names:
            if (path.parent / name).exists():
                (path.parent / name).replace(before[name])
            done.append(name)
            if partial[name].exists():
                partial[name].replace(path.parent / name)
    except OSError:
        with suppress(OSError):
            for name in reversed(done):
                _remove(path.parent / name)
                if before[name].exists():
                    before[name].replace(path.parent / name)
        raise
    finally:
        _remove(*partial.values())
    _remove(*before.values())


def _remove(*paths: Path) -> None:
    for path in paths:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
