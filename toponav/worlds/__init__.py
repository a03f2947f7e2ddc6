"""What exists: scenes, free space, generators and loaders."""
