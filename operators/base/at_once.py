"""What all operators share that change the scene: errors become one sentence, never a bare traceback."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ...addon.console import unexpected
from ...addon.core.errors import ScanRelightError

REPORTED = "Error: "
"""How Blender begins an operator's error where it raises it as an exception."""


class NothingDone(Exception):
    """There was nothing to do: a warning, and no undo step."""


class OneSentence:
    """Tells every error of an operator in one sentence."""

    def attempt(self, work: Callable[[], set[str]], folder: str = "") -> set[str]:
        """What `work` returns; cancelled where it fails, and `error.log` of what nobody foresaw goes to `folder`."""
        try:
            return work()
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
        except MemoryError:
            self.report({"ERROR"}, "The memory is used up; a greater texel size or a smaller atlas size takes less.")
        except NothingDone as error:
            self.report({"WARNING"}, str(error))
        except Exception as error:  # the last line of defence
            told = str(error).strip()
            if isinstance(error, RuntimeError) and told.startswith(REPORTED):  # by an operator that was called
                self.report({"ERROR"}, told.removeprefix(REPORTED))
            else:
                self.report({"ERROR"}, unexpected(error, folder or bpy.app.tempdir))
        return {"CANCELLED"}


class AtOnce(OneSentence):
    """Does `work` in one undo step; the sentences that it returns are told as `remarks` says."""

    bl_options = {"REGISTER", "UNDO"}
    remarks = "WARNING"

    def execute(self, context):
        def work() -> set[str]:
            for sentence in self.act(context) or ():
                self.report({self.remarks}, sentence)
            return {"FINISHED"}

        return self.attempt(work)

    def act(self, context):
        """`work`, with what an operator of this kind works on."""
        return self.work(context)
