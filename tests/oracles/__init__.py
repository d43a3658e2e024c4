"""What is right, in plain float64 numpy, from the formulas alone: nothing here imports the package."""
