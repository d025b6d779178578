"""Whether a grasp holds: the hand closes on the object in MuJoCo, and the object is pushed."""
