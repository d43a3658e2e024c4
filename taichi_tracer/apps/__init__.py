"""The programs: command line, window and page. They may import everything; nothing below imports them.

A file has one program, or one thing that several programs need, such as the table of options. Add a command as a file
of ``commands``.
"""
