"""Small numerics: rotations, and groups of linked things."""
