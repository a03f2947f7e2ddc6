"""Image-goal navigation: agents run in homes, judged as the Neural Topological SLAM paper does."""
