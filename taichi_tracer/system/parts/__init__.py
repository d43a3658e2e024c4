"""Parts that can be exchanged: how they are registered, replaced and observed, and which attributes they have.

A file has one question about a part, which it asks of every kind. Add a kind to ``HOMES`` in ``registry.py``.
"""
