"""Where an arm can bring the hand: inverse kinematics and collisions of the arm that carries it."""
