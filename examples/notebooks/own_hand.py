# %% [markdown]
# # Your own hand
#
# From a URDF to the best grasp: a hand of three fingers with four joints each, and a jar. All that graspatlas needs
# to know is the hand's URDF, the shape of the object, and which link touches which surface.

# %%
from pathlib import Path

import numpy as np

import graspatlas as ga

hand = ga.Hand.from_urdf(Path("../own_hand/three_fingers.urdf"))
print(len(hand.joints), "joints:", *hand.joints)

# %% [markdown]
# ## Where it touches
#
# A fingertip ends in a ball of 8 mm. Its pad is the point of the ball that looks inwards and down. `find_pads` finds
# pads by itself when the hand closes; here the patch is stated, to see what there is to state.

# %%
ball, radius = np.array([0.0, 0.0, 0.025]), 0.008  # in the frame of the last link [m]
inwards = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
pad = ga.patches.Point(tuple(ball + radius * inwards), tuple(inwards))

# %% [markdown]
# ## What it holds
#
# A jar, 60 mm wide and 100 mm high; fingers keep 5 mm off its rims. The jar is round, so the place of the thumb is
# frozen: otherwise the jar could spin while the hand stays still.

# %%
jar = ga.Body.cylinder("jar", 0.03, 0.1)
wall = ga.patches.Cylinder(radius=0.03, axis=(0.0, 0.0, 1.0), v_interval=(-0.045, 0.045))
contacts = (
    ga.Contact("thumb_distal", pad, wall, {"u": np.pi, "v": 0.0}),
    ga.Contact("left_distal", pad, wall),
    ga.Contact("right_distal", pad, wall),
)

# %% [markdown]
# ## How it moves
#
# The last joint of each finger turns 0.8 times as much as the one before, the two fingers spread alike, and the thumb
# does not spread. These couplings leave two dimensions.

# %%
couplings = [
    *({f"{finger}_dip": 1.0, f"{finger}_pip": -0.8} for finger in ("thumb", "left", "right")),
    {"thumb_spread": 1.0},
    {"left_spread": 1.0, "right_spread": 1.0},
]
problem = ga.Problem(
    name="jar",
    hand=hand,
    object=jar,
    contacts=contacts,
    motions=ga.HandMotions.from_couplings(couplings, hand.joints),
    pose_guess=ga.PoseGuess((0.0, 0.0, 0.09), (0.0, 0.0, 0.0, 1.0)),
)
problem

# %% [markdown]
# ## The best grasp

# %%
requirements = (ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree())
result = ga.optimize(
    problem, dimension=2, radius=0.2, epsilon=0.5, quality="manipulability_volume", require=requirements, refine=True
)
result

# %% [markdown]
# ## For the controller
#
# Where the palm belongs, the joints, and the posture 10 mm before the grasp:

# %%
best = result.refined_best
before = best.pregrasp(0.01)
print("palm in the jar's frame [m]:", best.palm_xyz.round(4))
for joint, angle in best.joint_positions.items():
    print(f"{joint:13} pregrasp {before.joint_positions[joint]:+.3f} rad, grasp {angle:+.3f} rad")

# %% [markdown]
# The same problem as a file is [jar.yaml](../own_hand/jar.yaml); docs/from_urdf.md explains every step.
