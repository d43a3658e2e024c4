"""The border to the code of the Taichi course: its students' files, its ids from 1, and renderers that only it has."""
