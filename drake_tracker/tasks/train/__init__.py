"""The train of Allen et al. 1991: two cameras, a model train, and an arm that grasps it."""
