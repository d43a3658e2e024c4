"""RT3, the scene files of another course: read, written and rendered."""
