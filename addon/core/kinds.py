"""What kind of number a module's constant is, where nobody chose it by the results that it gives.

A number that was chosen by results (a threshold, a weight, how many rays) is a field of a frozen `...Params`, or a
plain constant: `scripts/count_constants.py` counts both. These kinds are named where the constant is defined, and
counted apart.
"""

from typing import Annotated, TypeVar

T = TypeVar("T")
Code = Annotated[T, "a file format's, a protocol's or an enumeration's: its specification fixes it"]
Unit = Annotated[T, "a unit's conversion, or a constant of nature, of mathematics or of floating point"]
Limit = Annotated[T, "what a broken or hostile file may claim at most: no sound one comes near it"]
Block = Annotated[T, "how much is done at once: memory and time depend on it, results do not"]
Shown = Annotated[T, "what somebody looks at: sizes, colours, rows, seconds between two looks"]
Workload = Annotated[T, "a test room or a workload of the benchmark: no user's result depends on it"]
