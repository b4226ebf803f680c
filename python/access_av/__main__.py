"""``python -m access_av`` is ``access-av``."""

from __future__ import annotations

import os

from access_av import interrupt


def main() -> None:
    """Runs the command line; Ctrl-C is handled from the first import on."""
    # Campaigns have one thread per core; further threads of linear algebra would busy-wait. NumPy
    # reads the variable when it is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        interrupt.guard()
        from access_av.cli.main import main as run

        run()
    except SystemExit as ended:
        if ended.code == interrupt.INTERRUPTED:
            interrupt.end()
        raise
    except KeyboardInterrupt:
        interrupt.end()
    except BaseException:  # a library may convert the interruption to another exception
        if interrupt.may_have_come():
            interrupt.end()
        raise


if __name__ == "__main__":
    main()
