"""Training data and episodes of Neural Topological SLAM."""
