# %% [markdown]
# # What holds
#
# Which index tells whether a grasp holds? Compute two of them for all grasps of a can, then close the hand around
# some in MuJoCo, push the can, and look which ones kept it.
#
# `pip install 'graspatlas[mujoco]'`

# %%
import matplotlib.pyplot as plt
import numpy as np

import graspatlas as ga

problem = ga.load_problem("schunk_can")
result = ga.optimize(problem, quality=["holding_force", "manipulability_volume"], require=[ga.CollisionFree()])
result

# %% [markdown]
# ## Trials
#
# 24 grasps of the atlas, chosen at random, and the best one. Each is closed from its pregrasp, then pushed with 1 N
# for 2 s along six directions, one after another. It holds when the can stays within 50 mm and 15 degrees.

# %%
trials = ga.simulate(result, sample=24, breaking=False)
trials

# %% [markdown]
# ## Predicted and simulated

# %%
indices = {
    "holding force [N]": result.qualities[trials.charts],
    "manipulability volume": result.others["manipulability_volume"][trials.charts],
}
pushes = trials.survived.sum(axis=1)
figure, axes = plt.subplots(1, 2, figsize=(7.5, 2.6), sharey=True, layout="constrained")
for ax, (name, values) in zip(axes, indices.items(), strict=True):
    ax.scatter(values, pushes, s=28, c=np.where(trials.held, "tab:green", "tab:red"), alpha=0.7)
    ax.set_xlabel(name)
    ax.locator_params(axis="x", nbins=4)
axes[0].set_ylabel("pushes survived, of 6")
plt.show()

# %%
for name, values in indices.items():
    held, lost = values[trials.held].mean(), values[~trials.held].mean()
    print(f"{name:22} in the mean {held:9.4g} where it held, {lost:9.4g} where not")

# %% [markdown]
# Every grasp with a holding force above zero held. Some held without one: servos jam the can between the links.
# Manipulability says how well the hand moves the object, which is something else. docs/physics.md has the same for
# every bundled problem.
