"""The programs: command line and window. They may import everything; nothing below imports them."""
