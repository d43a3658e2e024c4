"""RT3, the scene files of another course: reading, writing and rendering."""
