"""The page of a whole atlas, served: what needs Python is done here, and shown there at once."""
