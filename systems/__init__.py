"""The systems of this project, a file each, and the vehicles of the fleet."""
