"""Parameter search for rules: search space, objective on training levels, and search with Optuna."""
