"""Work for Dask: workers on this machine or any scheduler's, and numbered tasks whose results come in their order."""
