"""Hard cases: scenes and rays for which rounding decides, with the results that each mode promises.

A file has cases of one subject, which are subclasses of ``case.Case`` or ``case.RendererCase``. Add a case to the file
of its subject, and enter it in ``catalogue.py``.
"""
