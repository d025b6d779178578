"""Many problems, or many settings of one, in processes of their own."""

from graspatlas.sweep.sweep import (
    ROWS,
    Run,
    Sweep,
    run_sweep,
)

__all__ = [
    "ROWS",
    "Run",
    "Sweep",
    "run_sweep",
]
