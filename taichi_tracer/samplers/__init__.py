"""Sequences of random numbers: one sampler per file. ``sampler`` states the interface."""
