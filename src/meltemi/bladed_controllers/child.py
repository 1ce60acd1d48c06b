"""Process that runs a controller library. Run as a script by ``host.py``; standard library only.

    python child.py LIBRARY PROCEDURE INPUT_FILE ROOT_NAME RECORDS SIZE

Standard input brings the first RECORDS records of the swap array, as float32, once a call; standard output answers
with ``aviFAIL`` and the length of a message (int32), the same records, and the message. The first answer, to no
request, states whether the library could be loaded. Output of the library goes to standard error, a file.
"""

from __future__ import annotations

import ctypes
import os
import select
import signal
import sys
import threading
import time

HEADER = 8
"""Bytes before the records of an answer."""
MESSAGE, NAMES = 4096, 65536
"""Bytes of the buffers for the message and for the root name, in which some libraries return names of channels."""


def main() -> None:
    """Load the library, then call it at each request."""
    library, procedure, input_file, root_name, records, size = sys.argv[1:]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent, which then ends this process
    requests, answers = os.fdopen(os.dup(0), "rb", 0), os.fdopen(os.dup(1), "wb", 0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    if hasattr(select, "poll"):
        threading.Thread(target=_end_with_the_parent, args=(requests.fileno(),), daemon=True).start()

    buffer = bytearray(HEADER + 4 * int(size))
    fail, length = ctypes.c_int32.from_buffer(buffer, 0), ctypes.c_int32.from_buffer(buffer, 4)
    swap = (ctypes.c_float * int(size)).from_buffer(buffer, HEADER)
    answer = memoryview(buffer)[: HEADER + 4 * int(records)]
    message = ctypes.create_string_buffer(MESSAGE)

    def reply(text: bytes) -> None:
        length.value = len(text)
        answers.write(answer)
        if text:
            answers.write(text)

    try:
        function = ctypes.CDLL(library)[procedure]
    except (OSError, AttributeError) as error:
        fail.value = -1
        reply(str(error).encode(errors="replace")[:MESSAGE])
        return
    function.restype = None
    arguments = (
        ctypes.byref(swap),
        ctypes.byref(fail),
        ctypes.create_string_buffer(os.fsencode(input_file)),
        ctypes.create_string_buffer(os.fsencode(root_name), NAMES),
        message,
    )
    reply(b"")
    while _read(requests, answer[HEADER:]):
        fail.value = 0
        function(*arguments)
        reply(message.value if fail.value else b"")


def _read(file: object, view: memoryview) -> bool:
    """Fill a buffer; False at the end of the file."""
    while len(view):
        n = file.readinto(view)  # type: ignore[attr-defined]
        if not n:
            return False
        view = view[n:]
    return True


def _end_with_the_parent(requests: int) -> None:
    """End with the parent process, even if the library never returns."""
    gone = select.poll()
    gone.register(requests, 0)
    gone.poll()
    time.sleep(1.0)  # time for main to end, so that the library can complete its files
    os._exit(0)


if __name__ == "__main__":
    main()
