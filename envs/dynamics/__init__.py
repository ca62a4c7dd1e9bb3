"""Vehicle motion and contact as plain mathematics, without highway-env."""
