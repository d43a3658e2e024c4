"""Measurements that compare the package with other renderers. They are not part of the tests."""
