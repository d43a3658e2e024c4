"""The program: ``taichi-tracer``, or ``python -m taichi_tracer``."""

from taichi_tracer.apps.interruption import EXIT_CODE, ignore, leave_at_once


def main() -> int:
    """Run the command line; a signal is minded before anything large is imported."""
    leave_at_once()
    from taichi_tracer.apps.cli import main as run

    code = run()
    if code > EXIT_CODE:
        ignore()  # what was asked for is being done
    return code


if __name__ == "__main__":
    raise SystemExit(main())
