"""Scenes that change with time: paths of grasps and trials in the simulator."""
