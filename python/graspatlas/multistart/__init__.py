"""The best of all feasible grasps: climbs from many starts, in rounds, until what may be missing is little."""
