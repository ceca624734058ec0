"""A layout that remembers what is drawn into it, and what a draw function is handed with it."""

from __future__ import annotations

import importlib
from types import SimpleNamespace

import pytest


class Layout:
    """Stands in for `UILayout`: takes every call, checks names of properties and operators, remembers all words."""

    def __init__(self, words=None, buttons=None, open_panels=True):
        self.words = [] if words is None else words
        self.buttons = [] if buttons is None else buttons
        self.bars: list = []
        self._open = open_panels
        self.enabled = self.active = True

    def _part(self):
        part = Layout(self.words, self.buttons, self._open)
        part.bars = self.bars
        return part

    def row(self, **_):
        return self._part()

    column = box = split = row

    def panel(self, idname, default_closed=False):
        assert idname.startswith("scan_relight")
        return self._part(), self._part() if self._open else None

    def label(self, text="", icon="NONE", **_):
        self.words.append(text)

    def separator(self, **_):
        """Nothing to remember."""

    def prop(self, owner, name, text=None, **_):
        described = owner.bl_rna.properties[name]
        assert described.description, f"{name} has no tooltip"
        self.words.append(described.name if text is None else text)

    def operator(self, name, text=None, icon="NONE", **_):
        import bpy

        module, function = name.split(".")
        kind = getattr(getattr(bpy.ops, module), function).get_rna_type()  # raises where there is none
        assert kind.description, f"{name} has no tooltip"
        self.buttons.append(name)
        self.words.append(kind.name if text is None else text)
        return SimpleNamespace()

    def progress(self, factor=0.0, text="", **_):
        assert 0 <= factor <= 1
        self.bars.append((factor, text))
        self.words.append(text)

    @property
    def text(self) -> str:
        """All words, as one sentence would be read over its lines."""
        return " ".join(self.words)


@pytest.fixture
def module(package):
    """A module of the registered package, by its name."""
    return lambda name: importlib.import_module(f"scan_relight.{name}")


@pytest.fixture
def draw(ops):
    """Draw a panel class over the present scene: what its layout remembers."""
    import bpy

    def drawn(cls, open_panels=True, width=300):
        layout = Layout(open_panels=open_panels)
        panel = SimpleNamespace(layout=layout)
        for name in dir(cls):
            if not name.startswith("__") and callable(getattr(cls, name)) and name not in ("draw", "bl_rna"):
                value = cls.__dict__.get(name)
                if value is None or isinstance(value, (staticmethod, classmethod)):
                    setattr(panel, name, getattr(cls, name))
                else:
                    setattr(panel, name, value.__get__(panel))
        context = SimpleNamespace(
            scene=bpy.context.scene,
            preferences=bpy.context.preferences,
            mode=bpy.context.mode,
            window_manager=bpy.context.window_manager,
            view_layer=bpy.context.view_layer,
            active_object=bpy.context.active_object,
            selected_objects=bpy.context.selected_objects,
        )
        assert cls.poll(context)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(importlib.import_module("scan_relight.operators.base.panel"), "region_width", lambda: width)
            cls.draw(panel, context)
        return layout

    return drawn


@pytest.fixture(autouse=True)
def no_job_is_left(request):
    """Every test begins and ends without a run."""
    yield
    if "package" in request.fixturenames:
        importlib.import_module("scan_relight.addon.bridge.job.job").forget()
        importlib.import_module("scan_relight.operators.recover.findings").forget()
