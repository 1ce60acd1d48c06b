"""Cache folder of the user and the secret key in it: what is unpickled was written by the same user.

Pickled data can run code. Folders into which others can write are refused, and each file is signed with the key, so
that a file that somebody else put there, or that came with an archive, counts as missing.
"""

from __future__ import annotations

import errno
import hmac
import os
import secrets
from contextlib import suppress
from functools import cache
from pathlib import Path

import platformdirs

SIGNATURE = 32
"""Bytes of a signature, and of the key."""
OTHERS_WRITE, OTHERS_USE = 0o022, 0o077


def cache_root() -> Path:
    """Folder of everything that the user's processes keep for each other; ``MELTEMI_CACHE_DIR`` moves it."""
    return Path(os.environ.get("MELTEMI_CACHE_DIR") or platformdirs.user_cache_dir("meltemi"))


def private_folder(*names: str) -> Path:
    """A folder in the cache of the user, created if it is missing.

    Raises:
      OSError: the folder cannot be created, or it or a folder around it belongs to another user or can be written by
        others.
    """
    folder = cache_root()
    folder.parent.mkdir(parents=True, exist_ok=True)
    for name in ("", *names):
        folder /= name
        folder.mkdir(mode=0o700, exist_ok=True)
        _check_owner(folder, OTHERS_WRITE)
    return folder


def _check_owner(path: Path, others: int) -> None:
    if not hasattr(os, "geteuid"):  # on Windows the folder of a user belongs to that user
        return
    known = path.stat()
    if known.st_uid != os.geteuid():
        why = "it belongs to another user"
    elif known.st_mode & others:
        why = f"others may {'write to' if others == OTHERS_WRITE else 'use'} it; chmod go-{others & 0o7:o} ends that"
        why = why.replace("go-2", "go-w").replace("go-7", "go-rwx")
    else:
        return
    raise PermissionError(errno.EPERM, f"{why}, or set MELTEMI_CACHE_DIR to a folder that belongs to you", str(path))


def user_key() -> bytes:
    """Secret key of the user, created once.

    Raises:
      OSError: the key cannot be created or read, or others can read it.
    """
    return _key_in(private_folder())


@cache
def _key_in(folder: Path) -> bytes:
    file = folder / "seal"
    if not file.exists():
        part = file.with_name(f".seal.{os.getpid()}.part")
        try:
            with os.fdopen(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "wb") as new:
                new.write(secrets.token_bytes(SIGNATURE))
            with suppress(FileExistsError):  # of a process that started at the same time: one key for both
                file.hardlink_to(part)
        finally:
            part.unlink(missing_ok=True)
    _check_owner(file, OTHERS_USE)
    known = file.read_bytes()
    if len(known) != SIGNATURE:
        raise OSError(errno.EINVAL, "not a key; remove it", str(file))
    return known


def signed(data: bytes, key: bytes) -> bytes:
    """Data behind its signature."""
    return hmac.digest(key, data, "sha256") + data


def verified(data: bytes, key: bytes) -> bytes | None:
    """Signed data without its signature; None if it is damaged or somebody else's."""
    content = data[SIGNATURE:]
    return content if hmac.compare_digest(data[:SIGNATURE], hmac.digest(key, content, "sha256")) else None
