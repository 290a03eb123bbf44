"""What the paper says beside what its systems do here, on one page: figures, claims, and the loop itself, running."""
