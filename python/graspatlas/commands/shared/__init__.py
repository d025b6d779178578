"""What several commands share: words of the command line, and what is said of a result."""
