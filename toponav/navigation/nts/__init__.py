"""The agent of Neural Topological SLAM."""
