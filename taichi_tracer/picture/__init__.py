"""The picture: its samples, its error, when it is finished, and how it is stored."""
