"""One run a folder: whoever writes into a folder holds it, and the operating system lets go when that run ends.

The lock is the system's own, on a file in the folder: it ends with its process, however that ends, and never has to be
cleared by hand. Where a file system has no locks, as on some network drives, folders are not guarded.
"""

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path

NAME = ".lock"
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
_locked: set[int] = set()  # descriptors of this process

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        os.lseek(file, 1 << 30, os.SEEK_SET)  # beyond the pid, which others may read
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        os.lseek(file, 0, os.SEEK_SET)

else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _let_go() -> None:
        while _locked:
            os.close(_locked.pop())

    os.register_at_fork(after_in_child=_let_go)  # a child that outlives this process would hold on to it


@contextlib.contextmanager
def held(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Hold a folder, which is made if missing, as long as the block runs.

    Raises BlockingIOError at once, naming the folder and the process, while another run holds it, here or in another
    process; any other OSError for a folder that cannot be made or written.
    """
    path = Path(folder) / NAME
    path.parent.mkdir(parents=True, exist_ok=True)
    while (file := _take(path)) is None:
        pass
    _locked.add(file)
    try:
        os.ftruncate(file, 0)
        os.write(file, str(os.getpid()).encode())
        yield
    finally:
        if file in _locked:  # not so in a child that leaves the block
            with contextlib.suppress(OSError):  # Windows removes no open file, and one without a lock does no harm
                path.unlink()
            _locked.remove(file)
            os.close(file)


def _take(path: Path) -> int | None:
    """Open and lock a file; None if it is not the one of its name any more, since its holder removed it meanwhile."""
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            _lock(file)
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                pid = os.read(file, 20).decode(errors="replace") or "unknown"
                raise BlockingIOError(f"{path.parent} is in use by another run (pid {pid})") from None
        if os.path.samestat(os.fstat(file), path.stat()):
            return file
    except FileNotFoundError:
        pass
    except OSError:
        os.close(file)
        raise
    os.close(file)
    return None
