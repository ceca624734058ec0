"""A Blender with its window on a screen of its own, driven from outside: questions, real clicks and keys, pictures."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from pathlib import Path

from PIL import Image

from tests.window import drag

INSIDE = Path(__file__).with_name("inside.py")
SIZE = 1360, 1000
PATIENCE = 90.0
"""Seconds until an answer counts as lost: other work may share the machine."""


def tool(name: str, blender: str) -> str | None:
    """A program that stands beside Blender, or on the PATH."""
    beside = Path(blender).resolve().with_name(name)
    return str(beside) if beside.exists() else shutil.which(name)


def missing(blender: str | None) -> str:
    """Why no window can be opened here; '' where one can."""
    if not blender or not (shutil.which(blender) or Path(blender).is_file()):
        return "no Blender: set BLENDER to its executable, or make one with scripts/make_blender.sh"
    lacking = [name for name in ("xdotool", "xwd") if tool(name, blender) is None]
    if tool("Xvfb", blender) is None and not os.environ.get("DISPLAY"):
        lacking.append("Xvfb")
    return f"no {' and no '.join(lacking)}" if lacking else ""


class Screen:
    """An X server without a screen; where there is no Xvfb, the one that $DISPLAY names."""

    def __init__(self, blender: str):
        self._server = None
        server = tool("Xvfb", blender)
        if server is None:
            self.name = os.environ["DISPLAY"]
            return
        out, into = os.pipe()
        self._server = subprocess.Popen(
            [
                server,
                "-displayfd",
                str(into),
                "-screen",
                "0",
                f"{SIZE[0]}x{SIZE[1]}x24",
                "+extension",
                "GLX",
                "+render",
                "-dpi",
                "96",
                "-noreset",
                "-nolisten",
                "tcp",
            ],
            pass_fds=[into],
            stderr=subprocess.DEVNULL,
        )
        os.close(into)
        with os.fdopen(out) as told:
            self.name = ":" + told.readline().strip()
        if self.name == ":":
            raise RuntimeError("Xvfb did not start.")

    def close(self) -> None:
        """End the server."""
        if self._server is not None:
            self._server.terminate()
            self._server.wait()


class Window:
    """A Blender with its window.

    Parameters
    ----------
    blender : str
        Executable.
    screen : Screen
    user : Path
        Blender's folder for the user's files: preferences and extensions.
    folder : Path
        For questions and answers; new.
    *arguments : str
        Further words for Blender, such as a file to open.
    tab : bool
        Open the sidebar at our tab; False leaves the window as an artist finds it.

    Attributes
    ----------
    actions : list of str
        What a hand has done so far: each click, key and drag.
    """

    def __init__(self, blender: str, screen: Screen, user: Path, folder: Path, *arguments: str, tab: bool = True):
        folder.mkdir(parents=True)
        self.folder, self._blender, self._count, self.actions = folder, blender, 0, []
        self._screen = screen.name
        self._environment = dict(
            environment(user),
            DISPLAY=screen.name,
            LIBGL_ALWAYS_SOFTWARE="1",
            XDG_RUNTIME_DIR=str(folder),
            # Mesa's software says that a card has no memory left; Blender would bake nothing on such a one.
            MESA_EXTENSION_OVERRIDE="-GL_NVX_gpu_memory_info -GL_ATI_meminfo",
        )
        folder.chmod(0o700)
        self._log = open(folder / "blender.log", "wb")
        self.process = subprocess.Popen(
            [
                blender,
                "--window-geometry",
                "0",
                "0",
                *map(str, SIZE),
                "-noaudio",
                *map(str, arguments),
                "--python",
                str(INSIDE),
                "--",
                str(folder),
            ],
            env=self._environment,
            stdout=self._log,
            stderr=subprocess.STDOUT,
            cwd=folder,
        )
        self.ask("open_tab()" if tab else "None")
        self._x = self._xdotool("search", "--onlyvisible", "--name", "Blender").split()[0]
        self._xdotool("windowfocus", self._x)

    @property
    def log(self) -> str:
        """What Blender wrote."""
        return (self.folder / "blender.log").read_text(encoding="utf-8", errors="replace")

    def ask(self, code: str, patience: float = PATIENCE):
        """The value of an expression inside Blender, or what statements leave in `answer`; see inside.py."""
        part, number = self.folder / "question", self._count
        self._count += 1
        part.write_text(code, encoding="utf-8")
        part.rename(self.folder / f"ask-{number}.py")
        answer, until = self.folder / f"answer-{number}.json", time.monotonic() + patience
        while not answer.exists():
            if self.process.poll() is not None:
                raise RuntimeError(f"Blender ended with {self.process.returncode}:\n{self.log[-2000:]}")
            if time.monotonic() > until:
                raise TimeoutError(f"no answer to: {code}\n{self.log[-2000:]}")
            time.sleep(0.01)
        told = json.loads(answer.read_text(encoding="utf-8"))
        if "error" in told:
            raise RuntimeError(told["error"])
        return told["value"]

    def tell(self, code: str) -> None:
        """Start something that leaves no time for an answer, such as Blender's end."""
        part = self.folder / "question"
        part.write_text(code, encoding="utf-8")
        part.rename(self.folder / f"ask-{self._count}.py")
        self._count += 1

    def wait_for(self, expression: str, patience: float = PATIENCE):
        """Ask again and again until the value is true; returns it."""
        until = time.monotonic() + patience
        while not (value := self.ask(expression)):
            if time.monotonic() > until:
                raise TimeoutError(f"never true: {expression}\n{self.log[-2000:]}")
            time.sleep(0.05)
        return value

    def click(self, *words: str, top: bool = True, across: tuple[float, ...] = (0.5, 0.25, 0.75)) -> None:
        """Press the sidebar's button whose Python command, or whose property's path, holds all `words`.

        It is looked for at these shares of the sidebar's width, from its top or from where it is scrolled to.
        """
        found = self.ask(f"find({words!r}, across={across!r}, top={top})", patience=300)
        assert isinstance(found, list), f"no button {words} among {found['seen']}"
        self.click_at(*found)

    def click_at(self, x: int, y: int) -> None:
        """Move the mouse there and press its button."""
        self.actions.append(f"click at {x}, {y}")
        self._xdotool(
            "mousemove",
            str(x),
            str(y),
            "sleep",
            "0.1",
            "mousemove_relative",
            "1",
            "0",
            "sleep",
            "0.2",
            "mousedown",
            "1",
            "sleep",
            "0.1",
            "mouseup",
            "1",
            "sleep",
            "0.2",
        )
        self.ask("None")  # it is back from whatever that was

    def turn_wheel(self, x: int, y: int, notches: int) -> None:
        """Turn the mouse's wheel there, down for more than 0."""
        if notches:
            self.actions.append(f"wheel at {x}, {y}")
            self._xdotool("mousemove", str(x), str(y), "sleep", "0.2", "mousemove_relative", "1", "0", "sleep", "0.2")
            for _ in range(abs(notches)):
                self._xdotool("click", "5" if notches > 0 else "4", "sleep", "0.1")
            self.ask("None")

    def key(self, *names: str, region: str = "WINDOW") -> float:
        """Press keys with the mouse in the middle of the 3D view; returns when that was (seconds since 1970)."""
        left, top, width, height = self.ask(f"rectangle({region!r})")
        self._xdotool(
            "mousemove",
            str(left + width // 3),
            str(top + height // 2),
            "sleep",
            "0.1",
            "mousemove_relative",
            "1",
            "0",
            "sleep",
            "0.2",
        )
        pressed = time.time()
        self.actions += [f"key {name}" for name in names]
        self._xdotool("key", *names)
        return pressed

    def drop(self, *files: Path, region: str = "WINDOW") -> None:
        """Drag files from outside into the middle of the 3D view."""
        self.actions.append(f"drag {', '.join(one.name for one in files)}")
        left, top, width, height = self.ask(f"rectangle({region!r})")
        drag.drop(self._screen, int(self._x), files, left + width // 2, top + height // 2)
        self.ask("None")

    def write(self, text: str) -> None:
        """Type."""
        self._xdotool("type", "--delay", "15", text)

    def press(self, *names: str) -> None:
        """Press keys where the mouse is."""
        self.actions += [f"key {name}" for name in names]
        self._xdotool("key", *names)

    def picture(self, out: Path | None = None, sidebar: bool = False) -> Image.Image:
        """What the screen shows, all of it or the sidebar; written to `out` too."""
        left, top, width, height = self.ask("rectangle()")
        self._xdotool("mousemove", str(left + width // 4), str(top + height - 30))
        self.ask("bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=2)")
        time.sleep(0.3)
        done = subprocess.run(
            [tool("xwd", self._blender), "-root", "-silent"], env=self._environment, check=True, capture_output=True
        )
        picture = read_xwd(done.stdout)
        if sidebar:
            left, top, width, height = self.ask("rectangle('UI')")
            picture = picture.crop((left, top, left + width, top + height))
        if out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            picture.save(out, optimize=True)
        return picture

    def close(self) -> None:
        """End Blender, and wait for that."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self._log.close()

    def _xdotool(self, *words: str) -> str:
        return subprocess.run(
            [tool("xdotool", self._blender), *words], env=self._environment, check=True, capture_output=True, text=True
        ).stdout


def environment(user: Path) -> dict[str, str]:
    """What Blender is started with: nothing of this process's own Blender or Python."""
    others = ("BLENDER_", "PYTHON", "VIRTUAL_ENV")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(others)}
    return dict(
        kept,
        BLENDER_USER_RESOURCES=str(user),
        HOME=str(user),
        SHARED=":".join(filter(None, (os.environ.get("SHARED"), str(INSIDE.parents[2])))),
    )


def read_xwd(data: bytes) -> Image.Image:
    """A picture in the format of X's window dumps, 32 bits a pixel (XWDFile.h of the X Window System)."""
    header = [int.from_bytes(data[k : k + 4], "big") for k in range(0, 100, 4)]
    start = header[0] + 12 * header[19]
    width, height, line = header[4], header[5], header[12]
    return Image.frombytes("RGB", (width, height), data[start : start + line * height], "raw", "BGRX", line)
