"""Hard cases: scenes and rays for which rounding decides, with the results that each mode promises.

A file has cases of one subject: subclasses of ``case.Case``, which ``studies.hard_cases`` lists, and functions under
``@case.renderer_case``. Add a case to the file of its subject.
"""
