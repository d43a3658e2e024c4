"""``python -m taichi_tracer`` is the command line."""

from taichi_tracer.apps.cli import main

raise SystemExit(main())
