"""Tests of the data of Neural Topological SLAM."""
