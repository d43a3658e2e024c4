"""``python -m taichi_tracer`` runs the command line."""

from taichi_tracer.apps.cli import main

raise SystemExit(main())
