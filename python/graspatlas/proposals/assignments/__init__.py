"""Which fingertips could touch which regions: pruned before a grasp is looked for."""
