"""What all operators share that change the scene at once: errors become one sentence, never a bare traceback."""

from __future__ import annotations

import bpy

from ..addon.console import unexpected
from ..addon.core.errors import ScanRelightError


class AtOnce:
    """Does `work` in one undo step; the sentences that it returns are told as `remarks` says."""

    remarks = "WARNING"

    def execute(self, context):
        """Do the work; every error that is foreseen becomes one sentence."""
        try:
            for sentence in self.act(context) or ():
                self.report({self.remarks}, sentence)
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except Exception as error:  # the last line of defence
            self.report({"ERROR"}, unexpected(error, bpy.app.tempdir))
            return {"CANCELLED"}
        return {"FINISHED"}

    def act(self, context):
        """`work`, with what an operator of this kind works on."""
        return self.work(context)
