"""The program ``graspatlas`` as ``python -m graspatlas``."""

from __future__ import annotations

from graspatlas.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
