"""What is handed to another team: a kit for each component, and the proof that an import behaves as ours."""
