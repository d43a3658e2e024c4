"""Tone curves: from radiance to what a screen can show.

A file has one class that derives from ``base.Tone``, with ``curve`` and ``white``, and is registered. Add a tone curve
as a new file of this folder.
"""
