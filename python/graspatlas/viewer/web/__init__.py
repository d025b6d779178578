"""Pages for a browser, and meshcat's server."""
