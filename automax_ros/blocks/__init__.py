"""The control blocks of J-3676-5, each as data and one step function."""
