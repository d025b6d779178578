"""The page on which a whole atlas of grasps is looked through, with the hand beside it."""
