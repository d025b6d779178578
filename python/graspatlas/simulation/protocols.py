"""How a grasp is tested: object, friction, actuators, the way in, the pushes, and what counts as held.

The figures of the tests that the field uses are those of their released configurations; ``shake`` is our own.
"""

from __future__ import annotations

from dataclasses import dataclass

from graspatlas.errors import unknown_name

__all__ = ["PROTOCOLS", "Protocol", "find_protocol"]


@dataclass(frozen=True)
class Protocol:
    """A test of grasps. Positions are held by servos: torque = stiffness (target - position) - damping velocity.

    Attributes:
        name: Its name.
        mass: Of the object [kg].
        friction: Coefficient of friction at all contacts.
        torsional: Torsional friction [m]: torque about the normal for a normal force of one; 0 for none.
        stiffness: Of the servo of a revolute joint [N m/rad].
        damping: Of the same servo [N m s/rad]; 0 for critical damping.
        largest_torque: That it can exert [N m].
        step: Of the simulation [s].
        closing: Time from pregrasp to grasp, and from grasp to squeeze [s].
        force: Of each push at the centre of mass, along +-x, +-y and +-z of the palm [N]; in the plane along +-x, +-y.
        seconds: That a push lasts.
        in_a_row: Pushes follow each other; else each begins afresh from the closed hand.
        breaks: Every object is also pushed, along many directions, by a force that grows until it is lost; else only
            that of the first grasp is.
        shift: Distance from the pose before closing that the object's centre of mass may move [m].
        turn: Angle that the object may turn [rad].
        start_depth: Penetration before closing that counts as a failure [m].
        source: Where the figures come from.
    """

    name: str
    mass: float = 0.1
    friction: float = 0.6
    torsional: float = 0.02
    stiffness: float = 5.0
    damping: float = 0.0
    largest_torque: float = 3.0
    step: float = 0.004
    closing: tuple[float, float] = (0.4, 0.4)
    force: float = 1.0
    seconds: float = 2.0
    in_a_row: bool = False
    breaks: bool = False
    shift: float = 0.05
    turn: float = 0.2617993877991494
    start_depth: float = 0.01
    source: str = ""


_DEXGRASPBENCH = "Chen et al., BODex and Dexonomy (2025), released configuration of DexGraspBench; MuJoCo"

#: Protocols of trials by name, as ``simulate(protocol=...)`` and the command line state them.
PROTOCOLS: dict[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        Protocol("dexgraspbench", source=_DEXGRASPBENCH),
        Protocol("dexgraspbench-30g", mass=0.03, force=0.3, source=_DEXGRASPBENCH + ", variant with 30 g"),
        Protocol(
            "dexgraspbench-hard", friction=0.3, torsional=0.002, force=0.3, source=_DEXGRASPBENCH + ", hard variant"
        ),
        Protocol(
            "multidex",
            friction=3.0,
            torsional=0.0,
            stiffness=1000.0,
            damping=200.0,
            largest_torque=1000.0,
            step=0.005,
            closing=(2.0, 2.0),  # ten times what these servos take
            force=0.05,
            seconds=1.0,
            in_a_row=True,
            shift=0.02,
            turn=float("inf"),
            start_depth=float("inf"),
            source="Wei et al., D(R,O) Grasp (2024): 0.5 m/s2 along each axis for 1 s; there in Isaac Gym",
        ),
        Protocol("shake", friction=0.5, torsional=0.0, breaks=True, source="our own"),
    )
}


def find_protocol(name: str | Protocol) -> Protocol:
    """The protocol of a name, or the protocol itself.

    Raises:
        GraspAtlasError: If there is no such protocol.
    """
    if isinstance(name, Protocol):
        return name
    if not isinstance(name, str) or name not in PROTOCOLS:
        raise unknown_name("protocol", name, PROTOCOLS)
    return PROTOCOLS[name]
