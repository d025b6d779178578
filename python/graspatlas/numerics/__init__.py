"""Small numerics: rotations, groups of linked things, and shortest ways between them."""
