"""What notebooks show: cards with a table and a picture."""
