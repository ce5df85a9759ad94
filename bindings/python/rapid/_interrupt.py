"""Ctrl-C during a call into the library."""
import contextlib
import os
import signal
import socket
import threading


class _Watcher:
    """Cancels the current call when SIGINT arrives.

    Python runs its signal handlers between bytecodes of the main thread, so no handler runs while that thread is inside
    the library. But the interpreter writes the signal's number to its wake-up descriptor at once, and a thread waits on
    it.
    """

    def __init__(self):
        self._lock = threading.Lock()
        self._cancel = None
        self._before = -1
        self._read, self._write = socket.socketpair()
        self._write.setblocking(False)
        threading.Thread(target=self._wait, daemon=True, name="rapid Ctrl-C").start()

    def _wait(self):
        while True:
            self._read.recv(1, socket.MSG_PEEK)
            with self._lock:
                if signal.SIGINT in self._take() and self._cancel:
                    self._cancel()

    def _take(self):
        """Returns the numbers of the pending signals, and forwards them to the program's own wake-up descriptor. The
        caller holds the lock."""
        try:
            numbers = self._read.recv(256, socket.MSG_DONTWAIT)
        except BlockingIOError:  # the call in which they arrived took them when it ended
            return b""
        if self._before != -1:
            os.write(self._before, numbers)
        return numbers

    @contextlib.contextmanager
    def cancelling(self, cancel):
        with self._lock:
            self._cancel = cancel
            self._before = signal.set_wakeup_fd(self._write.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            with self._lock:
                signal.set_wakeup_fd(self._before)
                self._take()  # a signal of this call must not cancel the next one
                self._cancel, self._before = None, -1


_watcher = None


def _watcher_of_process():
    global _watcher
    if _watcher is None:
        _watcher = _Watcher()
        os.register_at_fork(after_in_child=_forget_watcher)
    return _watcher


def _forget_watcher():
    global _watcher
    _watcher = None


@contextlib.contextmanager
def interruptible(cancel):
    """Wraps a call into the library: Ctrl-C cancels it and raises KeyboardInterrupt after it has returned.

    A handler of the program runs when the main thread is back in Python. Its exception is raised after the call,
    because an exception inside a callback would be lost on its way through C. Python handles signals only in the main
    thread, so this does nothing in other threads.
    """
    handler = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if not callable(handler):
        yield
        return
    raised = []

    def keep(number, frame):
        try:
            handler(number, frame)
        except BaseException as error:
            raised.append(error)
            cancel()

    signal.signal(signal.SIGINT, keep)
    watching = _watcher_of_process().cancelling(cancel) if handler is signal.default_int_handler else None
    try:
        with watching or contextlib.nullcontext():
            yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if raised:
            raise raised[0]
