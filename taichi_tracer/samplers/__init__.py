"""Samplers: sequences of random numbers.

A file has one class that derives from ``sampler.Sampler`` or ``points.PointSampler``, with one method that returns two
numbers, and is registered. Add a sampler as a new file of this folder.
"""
