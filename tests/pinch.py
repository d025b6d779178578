"""A box pinched by two sliding fingers with ball tips: what it withstands is known in closed form."""

from __future__ import annotations

import graspatlas as ga

#: Half the width of the box, and radius of the tips [m].
HALF, TIP = 0.02, 0.01


def pinch(friction: float = 0.5) -> ga.Problem:
    """Fingers along +-x of the palm, each on a slide of its own, on the faces of a box at the palm's origin."""
    parts = ['<robot name="pinch"><link name="palm"/>']
    for name, side in (("left", -1), ("right", 1)):
        parts.append(
            f'<link name="{name}"><collision><geometry><sphere radius="{TIP}"/></geometry></collision></link>'
            f'<joint name="{name}_slide" type="prismatic"><parent link="palm"/><child link="{name}"/>'
            f'<origin xyz="{side * 0.1} 0 0"/><axis xyz="{-side} 0 0"/>'
            '<limit lower="-0.02" upper="0.09" effort="20" velocity="1"/></joint>'
        )
    hand = ga.Hand("pinch", "".join([*parts, "</robot>"]))
    contacts = tuple(
        ga.Contact(
            name,
            ga.patches.Point((-side * TIP, 0, 0), (-side, 0, 0)),
            ga.patches.Plane((side * HALF, 0, 0), (side, 0, 0), u_axis=(0, 1, 0)),
        )
        for name, side in (("left", -1), ("right", 1))
    )
    at = 0.1 - HALF - TIP
    return ga.Problem(
        name="pinch",
        hand=hand,
        object=ga.Body.box("box", (2 * HALF, 0.06, 0.06)),
        contacts=contacts,
        x1=ga.FirstGrasp({"left_slide": at, "right_slide": at}),
    )
