"""What is done with a system: changes, troubles, runs, scores, pictures, campaigns."""
