# %% [markdown]
# # The can in a minute
#
# A hand of 13 joints holds a can with three fingers. Which of all the grasps that keep these contacts lets it move
# the can best?
#
# `pip install graspatlas`

# %%
import graspatlas as ga

problem = ga.load_problem("schunk_can")
problem

# %% [markdown]
# The middle finger keeps its place on the can; index finger and thumb touch its wall anywhere. That leaves 8
# freedoms. The problem keeps the two most important hand motions, and an atlas covers all grasps that are left:

# %%
result = ga.optimize(problem, refine=True)
result

# %% [markdown]
# *Complete* means that no step from any chart leads to a grasp that the atlas lacks. *Accepted* are the charts whose
# grasps meet the requirements: force closure, and no collision. *Refined* is the local maximum between the charts.

# %%
result.atlas

# %% [markdown]
# ## Look through it
#
# The next cell shows every chart beside the hand: point at one to see its grasp, or walk with the arrow keys. The
# page is too large to be kept in the file: run the cell to see it.

# %%
result.explore()

# %% [markdown]
# ## Another index
#
# The best grasp to move the can is not the best to hold it. The holding force is the largest push [N] that the
# fingers resist from any side. Choose by it, without another atlas:

# %%
holds = result.by("holding_force")
values = holds.qualities
print(
    f"the best to move withstands {values[result.best.chart]:.2f} N, the best to hold {values[holds.best.chart]:.2f} N"
)

# %%
holds.best

# %% [markdown]
# ## From one grasp to the other
#
# Both grasps are in one atlas, so the hand can change one into the other without letting go:

# %%
path = ga.shortest_path(holds, result.best.chart, holds.best.chart)
path

# %% [markdown]
# Where next: [your own hand](own_hand.ipynb), [what holds](what_holds.ipynb).
