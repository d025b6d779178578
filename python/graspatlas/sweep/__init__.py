"""Many problems, or many settings of one, in processes of their own."""

from graspatlas.sweep.rows import ROWS
from graspatlas.sweep.runs import Run
from graspatlas.sweep.sweep import Sweep, run_sweep

__all__ = ["ROWS", "Run", "Sweep", "run_sweep"]
