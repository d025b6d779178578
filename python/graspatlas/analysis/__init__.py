"""What is read on a result: local maxima, refined grasps, denser samples, trade-offs."""
