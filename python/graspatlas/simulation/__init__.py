"""Whether a grasp holds: the hand closes on the object in MuJoCo, and the object is pushed."""

from graspatlas.simulation.outcome import Simulation, load_simulation
from graspatlas.simulation.protocols import PROTOCOLS, Protocol
from graspatlas.simulation.recording import Recording, record
from graspatlas.simulation.runs import simulate, simulate_grasps

__all__ = [
    "PROTOCOLS",
    "Protocol",
    "Recording",
    "Simulation",
    "load_simulation",
    "record",
    "simulate",
    "simulate_grasps",
]
