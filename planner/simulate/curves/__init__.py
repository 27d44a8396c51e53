"""What curves over temperature look like: one shape a file, and the grid they live on."""
