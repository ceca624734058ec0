"""Write the hashed locks in requirements/ from their sources: `python scripts/lock.py [UV]`.

UV is the path of the uv program (default: the one on PATH). The locks hold no address: pip asks whatever registry it
is set up with, and the hashes say whether the answer is the right one.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "requirements"
LOCKS = {
    "blender-4.5": ["--python-version", "3.11"],
    "blender-5.2": ["--python-version", "3.13"],
    "extension": ["--python-version", "3.14", "--no-emit-package", "numpy"],
    "tools": ["--python-version", "3.11", "--universal", "--no-emit-package", "numpy"],
}


def main() -> None:
    uv = sys.argv[1] if len(sys.argv) > 1 else "uv"
    for name, options in LOCKS.items():
        lock = FOLDER / f"{name}.txt"
        compiled = [uv, "pip", "compile", "--quiet", "--upgrade", "--generate-hashes", *options]
        plain = ["--no-emit-index-url", "--no-header", "--no-annotate"]
        subprocess.run([*compiled, *plain, f"{name}.in", "-o", lock.name], cwd=FOLDER, check=True)
        lock.write_text(f"# Made by scripts/lock.py from {name}.in; do not edit.\n" + lock.read_text())
        print(lock.relative_to(FOLDER.parent))


if __name__ == "__main__":
    main()
