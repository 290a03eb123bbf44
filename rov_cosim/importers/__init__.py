"""The FMUs in the tools of others, and the page that tells how far their results are from ours."""
