"""From a grasp to the motion and the forces that carry it out."""
