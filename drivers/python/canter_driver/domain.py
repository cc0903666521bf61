"""Where the processes of one user find each other; the rule of `ipc::Domain` in Rust."""

import os
import stat

__all__ = ["directory", "prefix"]


def _private(path):
    """Why a directory does not belong to this user alone, or None."""
    found = os.lstat(path)
    if not stat.S_ISDIR(found.st_mode):
        return "it is not a directory (a link to one does not count)"
    if found.st_uid != os.geteuid():
        return f"it belongs to user {found.st_uid}, not to user {os.geteuid()}"
    if found.st_mode & 0o077:
        return f"other users may look into it (mode {found.st_mode & 0o7777:04o}): chmod 700"
    return None


def _choice():
    if named := os.environ.get("CANTER_DOMAIN"):
        return named
    user = os.geteuid()
    for runtime in (os.environ.get("XDG_RUNTIME_DIR"), f"/run/user/{user}"):
        if runtime and os.path.isabs(runtime) and os.path.isdir(runtime):
            if _private(os.path.realpath(runtime)) is None:
                return os.path.join(runtime, "canter")
    return f"/dev/shm/canter-{user}"


def directory():
    """The directory of this process's domain, made (mode 0700) if it is missing."""
    path = _choice()
    try:
        os.mkdir(path, 0o700)
    except FileExistsError:
        pass
    if cause := _private(path):
        raise PermissionError(f"{path}: {cause}")
    path = os.path.realpath(path)
    above = path
    while (above := os.path.dirname(above)) != os.path.dirname(above):
        mode = os.stat(above).st_mode
        if mode & 0o002 and not mode & stat.S_ISVTX:
            raise PermissionError(f"{path}: anybody may rename it, {above} is open to all")
    return path


def prefix(path):
    """The prefix of the names of a domain's segments in /dev/shm."""
    found = os.stat(path)
    return f"canter_{found.st_uid}_{found.st_dev:x}_{found.st_ino:x}_"
