"""Tone curves: how the light of a picture becomes what a screen can show. One file each."""
