# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a command to its exit code, and ends it on signals.

The exit codes are 0 for done and proved, 1 for a file that could not be written or a bug, 2 for bad usage or input, and 3
for not proved. Every failure except a bug prints one line to stderr. A signal ends the command with the exit code 128 plus
the signal's number, and its temporary files are removed.
"""

import os
import shutil
import signal
import socket
import sys
import threading
import traceback

from .. import package
from ..errors import NotProved, NotWritten, Refused
from ..files import safe_files
from .arguments import NOT_PROVED, NOT_WRITTEN, Stop


def end_on_signals(name, scratch=None, before=lambda number: None):
    """Makes SIGTERM, Ctrl-C and a closed terminal remove the temporary files and end the process, even in native calls.

    name: of the command, for the message; scratch: a further folder to remove; before: is called with the number of the
    signal first.
    """
    # Python runs signal handlers only between two of its instructions, and a native call may take minutes. A thread reads
    # the signals instead.
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    for signal_name in ("SIGTERM", "SIGINT", "SIGHUP"):
        number = getattr(signal, signal_name, None)  # Windows does not have all of these signals.
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:  # nohup makes the process ignore SIGHUP.
            signal.signal(number, lambda *_: None)

    def end():
        with writer:  # The reference keeps the socket open.
            number = reader.recv(1)[0]
        before(number)
        safe_files.remove_all()
        if scratch:
            shutil.rmtree(scratch, ignore_errors=True)
        print(f"{name}: ended by {signal.Signals(number).name}", file=sys.stderr, flush=True)
        os._exit(128 + number)

    threading.Thread(target=end, daemon=True).start()


def exit_code(name, work):
    """Returns the exit code of a command: that of work(), or that of its failure, which is printed with the name."""
    code = 1
    try:
        code = _without_own_errors(work)
    except SystemExit as done:  # --help raises this.
        code = done.code
    except Stop as stop:
        print(f"{name}: {stop}", file=sys.stderr)
        code = stop.code
    except Exception:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _without_own_errors(work):
    try:
        return work()
    except NotWritten as error:
        raise Stop(str(error), NOT_WRITTEN) from None
    except NotProved as error:
        raise Stop(str(error), NOT_PROVED) from None
    except Refused as error:
        raise Stop(str(error)) from None
    except Exception as error:
        if package.module is not None and isinstance(error, package.module.TolvolError):
            raise Stop(str(error)) from None
        raise
