"""What students get: an assignment without its solution, as a folder or as a notebook.

A file has one step on the way from the solved assignment to what is handed out.
"""
