"""One run a folder: a lock that the system lets go of when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

from fem_spa.errors import InputError

NAME = ".lock"
_BUSY = (errno.EAGAIN, errno.EACCES, errno.EWOULDBLOCK, errno.EDEADLK)


class Claim:
    """The right to write into a folder, as a context manager; the folder must be there.

    The lock is the system's on the file `.lock`, which names process and machine. A killed run leaves the
    file but not the lock, so the next one may have the folder. Where the file system knows no locks there is
    none.

    Raises
    ------
    InputError
        Another run has the folder.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / NAME
        self._handle: int | None = None

    def __enter__(self) -> Claim:
        while self._handle is None:
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                _lock(handle, self.path)
            except BaseException:
                os.close(handle)
                raise
            if _same(handle, self.path):
                self._handle = handle
            else:  # its holder removed it before it let go
                os.close(handle)
        os.ftruncate(self._handle, 0)
        os.write(self._handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._handle is not None:
            with contextlib.suppress(OSError):
                self.path.unlink(missing_ok=True)
            os.close(self._handle)
            self._handle = None


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Make a folder and keep other runs out of it for a block; what was made and stays empty goes again.

    Raises
    ------
    InputError
        The folder cannot be written, or another run has it; from the block what it raises.
    """
    made = [part for part in (folder, *folder.parents) if not part.exists()]
    with contextlib.ExitStack() as stack:
        stack.callback(_remove_empty, made)
        with refused(folder):
            folder.mkdir(parents=True, exist_ok=True)
            stack.enter_context(Claim(folder))
        yield


@contextlib.contextmanager
def refused(folder: Path) -> Iterator[None]:
    """A folder that the block cannot write to is a wrong input."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"given {folder} for --out: it cannot be written ({error.strerror}); give another folder"
        ) from None


def _remove_empty(folders: Sequence[Path]) -> None:
    """Remove folders, each within the next, up to the first that something is in."""
    with contextlib.suppress(OSError):
        for folder in folders:
            folder.rmdir()


def refuse_busy(folder: Path) -> None:
    """Refuse a folder into which another run is writing; leaves no trace.

    Raises
    ------
    InputError
        as `Claim`
    """
    try:
        handle = os.open(folder / NAME, os.O_RDWR)
    except OSError:
        return
    try:
        _lock(handle, folder / NAME)
    finally:
        os.close(handle)


def _lock(handle: int, path: Path) -> None:
    """Lock an open file without waiting."""
    try:
        try:
            import fcntl
        except ImportError:  # Windows
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
            return
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in _BUSY:
            return
        holder = os.read(handle, 200).decode("utf-8", "replace").strip() if os.name == "posix" else ""
        raise InputError(
            f"given {path.parent} for --out: another run is writing there ({holder or 'it is alive'}); "
            "wait for its end, or give another folder"
        ) from None


def _same(handle: int, path: Path) -> bool:
    """Whether an open file is still the one of that name."""
    try:
        there, mine = os.stat(path), os.fstat(handle)
    except FileNotFoundError:
        return False
    return (there.st_dev, there.st_ino) == (mine.st_dev, mine.st_ino)
