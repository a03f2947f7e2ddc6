"""Networks of Neural Topological SLAM."""
