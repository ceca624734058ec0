"""Where a run goes on that was stopped: told from the files alone, before anything is read."""

from pathlib import Path

from ..io.folder import REPORT
from ..stages import STAGES, WRITE
from .store import STAGES as FOLDER


def goes_on_with(result: Path | str) -> str:
    """The stage that the next run into `result` begins with, where a run was stopped there; '' else.

    The report is what a run writes last, so a result whose report is no older than its stages is finished. A stage that
    is older than the one before it belongs to an earlier run. Whether the settings are still the same is not asked.
    """
    result = Path(result)
    times = [_time(result / FOLDER / f"{name}.npz") for name in STAGES]
    if not times[0] or _time(result / REPORT) >= max(times):
        return ""
    done = 1
    while done < len(STAGES) and times[done] >= times[done - 1]:
        done += 1
    return STAGES[done] if done < len(STAGES) else WRITE


def _time(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
