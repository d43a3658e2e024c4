"""The picture: its samples, its error, when it is done, and how it is kept."""
