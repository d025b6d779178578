"""Names of what an MJCF holds, also of what it leaves unnamed; no two alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mujoco

__all__ = ["Names"]


class Names:
    """Names of bodies, joints, sites, tendons and geoms by their numbers.

    Attributes:
        bodies: Of all bodies, the world's first.
        joints: Of all joints.
        sites: Of all sites; empty where a site has none.
        tendons: Of all tendons.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._links: set[str] = set()
        self._joints: set[str] = set()
        self._model = model
        self.bodies = [self.new_link(model.body(b).name or f"body_{b}") for b in range(model.nbody)]
        owners = [int(body) for body in model.jnt_bodyid]
        self.joints = [
            self.new_joint(model.joint(j).name or f"{self.bodies[owner]}_joint") for j, owner in enumerate(owners)
        ]
        named = [str(model.site(s).name) for s in range(model.nsite)]
        self.sites = [self.new_link(name) if name else "" for name in named]
        self.tendons = [str(model.tendon(t).name or f"tendon_{t}") for t in range(model.ntendon)]

    def new_link(self, wanted: str) -> str:
        """A name for a link that no other has."""
        return _unused(wanted, self._links)

    def new_joint(self, wanted: str) -> str:
        """A name for a joint that no other has."""
        return _unused(wanted, self._joints)

    def geom(self, number: int) -> str:
        """Name of a geom."""
        return str(self._model.geom(number).name or f"geom_{number}")


def _unused(wanted: str, used: set[str]) -> str:
    name, count = wanted, 1
    while name in used:
        count += 1
        name = f"{wanted}_{count}"
    used.add(name)
    return name
