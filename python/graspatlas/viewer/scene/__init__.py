"""The scene of a grasp: bodies, camera, captions."""
